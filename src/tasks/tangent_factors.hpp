// Factors of the tangent of a mechanical system, whatever linear solver a run has.
#pragma once
#include <petscmat.h>
#include "base/factor_memory.hpp"
#include "systems/mechanics.hpp"

namespace bs {

/// L D L^T of a M - K by MUMPS, K symmetric, at the state that the linearisation has. All particles are free.
class TangentFactors {
 public:
  /// Collective. `lin` must outlive the object.
  PetscErrorCode create(Linearisation& lin);
  /// Mean of omega^2 of -K q = omega^2 M q: the trace of -K, its entries taken positive, by that of M; 0: nothing resists anything.
  double mean() const { return mean_; }
  /// Collective. good: false where MUMPS is not there or failed.
  PetscErrorCode factor(double shift, bool* good);
  /// Collective. The same of part diag(s) - K, s being the stiffness of all springs at each particle (Linearisation::stiffness_sizes).
  PetscErrorCode factor_raised(double part, bool* good);
  /// Collective. Whether the last factors were not made for want of memory.
  PetscErrorCode memory_lack(MemoryLack* out) const { return find_memory_lack(factors_, out); }
  /// Of the last factors.
  PetscErrorCode negative_pivots(PetscInt* count) const;
  /// Collective. z_x = (shift M - K)^-1 r_v, laid out as states; the rest of z is 0.
  PetscErrorCode solve(Vec r, Vec z);

 private:
  PetscErrorCode factor_present(bool* good);
  Linearisation* lin_ = nullptr;
  MatHandle S_, factors_;
  VecHandle b_, w_;
  double mean_ = 0;
};

}  // namespace bs
