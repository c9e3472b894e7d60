#include "tasks/tangent_solve.hpp"
#include "solvers/condensed/condensed.hpp"
#include "time/ts_queries.hpp"

namespace bs {

PetscErrorCode TangentSolve::prepare(TS ts, Mat J, Equilibrium& model, double t, Vec y, TangentFactors* factors) {
  constexpr double RTOL = 1e-10, SHIFT = 1e-9;
  PC pc;
  PetscFunctionBegin;
  model_ = &model;
  PetscCall(linear_solver_of(ts, &ksp_, &pc));
  PetscCall(condensed_demand(pc, &demand_));
  PetscCall(KSPGetTolerances(ksp_, &rtol_, nullptr, nullptr, nullptr));
  PetscCall(condensed_set_tangent(pc, model.tangent(), {}));  // S itself is solved with, definite or not
  PetscCall(condensed_renew(pc));
  PetscCall(model.linearise_sharply(t, y, J));
  PetscCall(KSPSetOperators(ksp_, J, J));
  PetscCall(KSPSetTolerances(ksp_, rough_ ? ROUGH : RTOL, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  for (VecHandle* vec : {&r_, &z_}) PetscCall(VecDuplicate(y, vec->out()));
  factors_ = factors;
  if (!factors) PetscFunctionReturn(0);
  bool good = false;
  PetscCall(factors->create(model.mechanics()->linearisation()));
  if (factors->mean() > 0) PetscCall(factors->factor(SHIFT * factors->mean(), &good));
  if (!good) factors_ = nullptr;
  PetscFunctionReturn(0);
}

PetscErrorCode TangentSolve::give_back() {
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(condensed_set_tangent(pc, model_->tangent(), demand_));
  PetscCall(condensed_renew(pc));
  PetscCall(KSPSetTolerances(ksp_, rtol_, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

// u <- u + (shift M - K)^-1 r,  r = f + K u with the exact K, until r is down to rounding: neither the shift nor the precision in which the
// matrix is stored is left in u.
PetscErrorCode TangentSolve::solve(Vec load, Vec u, double* left) {
  constexpr double SLOW = 0.5;
  constexpr int MOST = 50;
  const double done = rough_ ? 2 * ROUGH : 1e-13;
  Linearisation& lin = model_->mechanics()->linearisation();
  const Layout& at = lin.layout();
  PetscReal first = 0, size = 0, before = 0;
  PetscFunctionBegin;
  force_.resize(static_cast<std::size_t>(at.particles * at.dim));
  PetscCall(VecZeroEntries(u));
  PetscCall(VecCopy(load, r_));
  PetscCall(VecNorm(load, NORM_2, &first));
  *left = -1;
  if (first == 0) PetscFunctionReturn(0);
  size = before = first;
  for (int pass = 0; pass < MOST && size > done * first && (pass == 0 || size <= SLOW * before); ++pass) {
    PetscScalar* r = nullptr;
    PetscCall(factors_ ? factors_->solve(r_, z_) : KSPSolve(ksp_, r_, z_));
    PetscCall(VecAXPY(u, 1.0, z_));
    PetscCall(zero_velocities(u));
    PetscCall(lin.change_of_force(u, force_.data()));
    PetscCall(VecCopy(load, r_));
    PetscCall(VecGetArray(r_, &r));
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) r[at.v(i, c)] += force_[static_cast<std::size_t>(i * at.dim + c)];
    PetscCall(VecRestoreArray(r_, &r));
    before = size;
    PetscCall(VecNorm(r_, NORM_2, &size));
  }
  *left = size / first;
  PetscFunctionReturn(0);
}

}  // namespace bs
