// Which parts break, and when: options and the lattice's limits.
#pragma once
#include <petscsys.h>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>
#include "lattice/columns.hpp"
#include "lattice/lattice.hpp"

namespace bs {

class Section;
struct Network;

struct BreakRules {
  enum Side { tension, compression, both };
  enum Scatter { none, weibull, uniform };
  /// The same for all springs whose lattice gives none; infinite: no limit.
  double limit[BREAK_LIMITS] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                                std::numeric_limits<double>::infinity()};
  /// The same for each kind of interactions (place in interaction_schemas()) by turn_limits.
  std::vector<std::array<double, TURN_LIMITS>> turn_limit;
  Side side = tension;
  bool worst = false;      ///< one part at a time, that of the largest excess; else every one past its limit
  Scatter scatter = none;  ///< of the limits, by a factor for each part
  double width = 0;        ///< Weibull modulus, or half width of the uniform distribution
  std::int64_t seed = 0;
  std::vector<std::string> spared;  ///< groups whose parts do not break
  bool with_springs = false;        ///< interactions break with a spring along one of their sides
  bool notched = false;
  double notch[4] = {0, 0, 0, 0};  ///< from (x, y) to (x, y) [m]: springs that cross it at the start are broken

  /// Collective. Reads the -bs_break_ options. Errors (exit 2): values out of range; groups that the lattice has not; limits of the lattice that are
  /// no number > 0 or inf.
  PetscErrorCode read(MPI_Comm comm, const Lattice& lattice);
  /// Whether some spring may break, or some interaction of that kind.
  bool active(const Lattice& lattice) const;
  bool active(const Lattice& lattice, std::size_t kind) const;
  /// Factor of the limits of the part of that row, of springs (0) or of the interactions of a kind (1 + kind):
  ///   Weibull (-ln(1 - U))^(1/M);  uniform 1 + W (2U - 1);  U uniform in [0, 1) by the row
  double factor(std::int64_t row, std::int64_t of = 0) const;
  /// (n + ghosts) 1: of a group that is spared.
  std::vector<std::uint8_t> spared_particles(const Network& net) const;
  /// For the header; empty where nothing has a limit.
  std::string describe(const Lattice& lattice) const;

 private:
  PetscErrorCode check(MPI_Comm comm, const Lattice& lattice) const;
  void read_turns(Section& options);
};

}  // namespace bs
