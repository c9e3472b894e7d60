// What is known of the stability of the equilibria of a static run.
#pragma once
#include <petscts.h>
#include <cstdint>
#include <vector>
#include "base/error.hpp"
#include "systems/equilibrium.hpp"
#include "tasks/statics/pseudo_time.hpp"
#include "time/ts_setup.hpp"

namespace bs {

/// An equilibrium is unstable where -K has negative eigenvalues beyond its rounding errors. Direct solvers count them by the signs of their pivots
/// (Sylvester's law of inertia). Others look for one direction z with z.K z > 0, which proves instability; that none was found proves nothing.
class Stability {
 public:
  /// `iterations`: of the search for an unstable direction; 0: none.
  explicit Stability(std::int64_t iterations) : iterations_(iterations) {}
  /// Collective. At the state y of a frame at `factor`, the load factor or the way along a path, with the matrix J of `ts`; adds to its observables.
  /// One at 0 is the lattice as it was given and is not counted. A change of J is not undone; what `solver` knows of the state is not computed again.
  PetscErrorCode assess(TS ts, Mat J, Equilibrium& model, const PseudoTime& solver, double factor, Vec y, std::vector<Observable>* out);
  /// What assess() adds for a state that is no equilibrium.
  static void skip(std::vector<Observable>* out);
  void count(std::vector<Tally>* out) const;
  PetscErrorCode warn(Warnings* warnings) const;
  void save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  enum class Verdict { unstable = -1, unknown = 0, stable = 1 };
  void note(double clock, double factor, PetscInt negative, Verdict verdict);

  std::int64_t iterations_;
  std::int64_t stable_ = 0, unstable_ = 0, unknown_ = 0;  ///< equilibria
  std::int64_t changes_ = 0;                              ///< of the number of negative pivots, from one equilibrium to the next
  std::int64_t before_ = -1, most_ = -1;                  ///< negative pivots at the last equilibrium, and at the most of any; -1: not known
  double first_unstable_ = 0;                             ///< load factor
  double last_ = -1;                                      ///< load factor, or way along a path, of what was noted last
};

}  // namespace bs
