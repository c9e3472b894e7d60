// Linear systems with the exact tangent of an equilibrium.
#pragma once
#include <petscmat.h>
#include <petscts.h>
#include <vector>
#include "base/factor_memory.hpp"
#include "linalg/condensed/condensed.hpp"
#include "systems/equilibrium.hpp"
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

/// K u = -f with K = df/dx, by the linear solver of a static run, and where that leaves too much by factors of MUMPS. Both precondition a search for
/// the least residual along all directions so far (generalised conjugate residuals), as K may have many eigenvalues next to 0: floppy parts, soft
/// modes of nets under small stresses, with either sign.
class TangentSolve {
 public:
  /// Collective. Linearises `model` at the equilibrium y of time t, with the matrix J of `ts`; the model must outlive the object.
  PetscErrorCode prepare(TS ts, Mat J, Equilibrium& model, double t, Vec y);
  /// From now on f + K u may be ROUGH of f; both solvers do that in fewer iterations.
  void allow_rough() { rough_ = true; }
  /// Before or after prepare(): MUMPS from now on. direct(): whether it has come to that.
  void use_factors() { direct_ = true; }
  bool direct() const { return direct_; }
  /// After solve(): whether a linear solver was left out for want of memory.
  const MemoryLack& memory_lack() const { return lack_; }
  /// After solve(): f + K u of the owned particles, in the places of v; borrowed.
  Vec residual() const { return r_; }
  /// Collective. load and u are laid out as states: f stands in the places of v, u in those of x. left: |f + K u|/|f|, of the best that rounding
  /// allows, `enough` at least where the solver can; -1: f is 0, and so is u; NaN: the linear solver failed.
  PetscErrorCode solve(Vec load, Vec u, double enough, double* left);
  /// Collective. The linear solver is again what it was before prepare(), for load steps to go on.
  PetscErrorCode restore_solver();

 private:
  static constexpr double ROUGH = 1e-5;
  PetscErrorCode factor();
  PetscErrorCode product(Vec z, Vec w);
  PetscErrorCode add_direction(std::size_t count, double* length);
  PetscErrorCode iterate(Vec load, Vec u, double* left);
  Equilibrium* model_ = nullptr;
  TangentFactors factors_;
  KSP ksp_ = nullptr;
  CondensedDemand demand_;  ///< before
  PetscReal rtol_ = 0;      ///< likewise
  bool rough_ = false, direct_ = false, factored_ = false;
  MemoryLack lack_;
  VecHandle r_;
  std::vector<VecHandle> z_, w_;  ///< directions, and -K of them, orthonormal
  std::vector<double> force_;
};

}  // namespace bs
