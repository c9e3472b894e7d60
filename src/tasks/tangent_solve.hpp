// Linear systems with the exact tangent of an equilibrium.
#pragma once
#include <petscts.h>
#include <vector>
#include "solvers/condensed/condensed.hpp"
#include "systems/equilibrium.hpp"
#include "tasks/tangent_factors.hpp"

namespace bs {

/// K u = -f with K = df/dx, by the linear solver of a static run.
class TangentSolve {
 public:
  /// Collective. Linearises `model` at the equilibrium y of time t, with the matrix J of `ts`; the model must outlive the object. `factors`, where it
  /// is not null, is made the linear solver instead; it must outlive the object, too.
  PetscErrorCode prepare(TS ts, Mat J, Equilibrium& model, double t, Vec y, TangentFactors* factors = nullptr);
  /// From now on f + K u may be ROUGH of f; both solvers do that in fewer iterations.
  void be_rough() { rough_ = true; }
  /// After solve(): f + K u of the owned particles, in the places of v; borrowed.
  Vec residual() const { return r_; }
  /// Collective. load and u are laid out as states: f stands in the places of v, u in those of x. left: |f + K u|/|f|, of the best that rounding
  /// allows; -1: f is 0, and so is u; NaN: the linear solver failed.
  PetscErrorCode solve(Vec load, Vec u, double* left);
  /// Collective. The linear solver is again what it was before prepare(), for load steps to go on.
  PetscErrorCode give_back();

 private:
  static constexpr double ROUGH = 1e-5;
  Equilibrium* model_ = nullptr;
  TangentFactors* factors_ = nullptr;
  KSP ksp_ = nullptr;
  CondensedDemand demand_;  ///< before
  PetscReal rtol_ = 0;      ///< likewise
  bool rough_ = false;
  VecHandle r_, z_;
  std::vector<double> force_;
};

}  // namespace bs
