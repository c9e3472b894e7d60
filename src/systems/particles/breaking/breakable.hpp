// One kind of parts that may break, as a term offers it to Breaking: springs, or the interactions of one law.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"
#include "systems/particles/local_state.hpp"
#include "systems/system.hpp"

namespace bs {

/// A part that broke, as it was then.
struct Broken {
  std::int64_t number = 0;  ///< among all that broke, from 0
  std::int64_t row = 0;     ///< in the input, among its kind
  std::int64_t ends[MOST_ENDS] = {};
  std::int64_t avalanche = 0;
  double time = 0, load = 0, strain = 0, energy = 0;
  int kind = 0;  ///< place in the list of kinds that may break
};

/// One that is past its limit: by how much (1: at it), and what it had lost before it broke [J].
struct PastLimit {
  double excess, dissipated;
  Broken part;
};

/// How a kind is called in output.
struct BreakWords {
  std::string title;   ///< "spring", in sentences
  std::string row;     ///< "spring", of the column of rows in its list
  std::string events;  ///< "broken", of the list in /events
  std::string count;   ///< "broken_springs", of the observable and the tally
  std::string kept;    ///< "break_", what its numbers in checkpoints begin with
  std::string strain;  ///< "strain", of the column of what it was like
  int ends = 2;
  Powers powers = {};  ///< of that column's unit
};

/// A part that broke stays where it is and exerts nothing, so that patterns, storages and loops are those of the whole lattice. A part is judged by
/// one rank; every rank is told what broke.
class Breakable {
 public:
  virtual ~Breakable() = default;
  virtual const BreakWords& words() const = 0;
  /// Whether the lattice had broken ones from the start.
  virtual bool given_broken() const = 0;
  /// Adds those that this rank judges and that are past their limits.
  virtual void judge(const LocalState& state, std::vector<PastLimit>* found) const = 0;
  /// Whether these are springs, whose breaks others may follow.
  virtual bool leads() const { return false; }
  /// Collective. Adds those that this rank judges and that break because these springs, rows ascending, did.
  virtual PetscErrorCode follow(const std::vector<std::int64_t>& /* springs */, const LocalState&, std::vector<PastLimit>*) const { return 0; }
  /// The part of that row breaks, wherever this rank has it.
  virtual void cut(std::int64_t row) = 0;
  /// As Breaks::mark() and Breaks::revert().
  virtual void mark() = 0;
  virtual void revert() = 0;
  /// All are whole again but those that the lattice gave as broken, with the numbers that they had when they broke.
  virtual void mend() = 0;
  /// Collective. 1 for every broken one, in the input's order; borrowed.
  virtual PetscErrorCode flags(Vec* out) = 0;
};

}  // namespace bs
