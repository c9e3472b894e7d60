#include "tasks/tangent_solve.hpp"
#include <algorithm>
#include <cmath>
#include <vector>
#include "base/collective.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/solver_options.hpp"
#include "systems/frame_rows.hpp"
#include "time/methods.hpp"

namespace bs {

PetscErrorCode TangentFactors::create(Linearisation& lin) {
  const Layout& at = lin.layout();
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  lin_ = &lin;
  PetscCall(lin.create(CondensedStorage::aij, S_.out()));
  PetscCall(lin.assemble({0, 0, 1}, false, S_));
  PetscCall(MatCreateVecs(S_, b_.out(), w_.out()));
  PetscCall(MatGetDiagonal(S_, b_));
  const ReadArray a(b_);
  for (PetscInt k = 0; k < at.particles * at.dim; ++k) sums[0] += std::abs(a[k]);
  for (PetscInt i = 0; i < at.particles; ++i) sums[1] += static_cast<double>(at.dim) * lin.masses()[static_cast<std::size_t>(i)];
  PetscCall(sum_over_ranks(lin.comm(), sums, 2));
  mean_ = sums[0] / sums[1];
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::factor(double shift, bool* good) {
  PetscFunctionBegin;
  PetscCall(lin_->assemble({shift, 0, 1}, false, S_));
  PetscCall(factor_present(good));
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::factor_raised(double part, bool* good) {
  const Layout& at = lin_->layout();
  std::vector<double> size(static_cast<std::size_t>(at.particles));
  double largest = 0;
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(lin_->assemble({0, 0, 1}, false, S_));
  lin_->stiffness_sizes(size.data());
  for (const double s : size) largest = std::max(largest, s);
  PetscCall(max_over_ranks(lin_->comm(), &largest));
  for (double& s : size) s = s > 0 ? s : largest;  // what has no spring at all has no resistance, whatever is added
  PetscCall(VecGetArrayWrite(b_, &a));
  for (PetscInt k = 0; k < at.particles * at.dim; ++k) a[k] = part * size[static_cast<std::size_t>(k / at.dim)];
  PetscCall(VecRestoreArrayWrite(b_, &a));
  PetscCall(MatDiagonalSet(S_, b_, ADD_VALUES));
  PetscCall(factor_present(good));
  PetscFunctionReturn(0);
}

/// Of S_.
PetscErrorCode TangentFactors::factor_present(bool* good) {
  MatFactorInfo info;
  MatFactorError failed;
  PetscBool there = PETSC_FALSE;
  PetscFunctionBegin;
  *good = false;
  PetscCall(MatGetFactorAvailable(S_, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, &there));
  if (!there) PetscFunctionReturn(0);
  PetscCall(MatSetOption(S_, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(S_, MAT_SPD, PETSC_FALSE));
  PetscInt percent = 0;
  do {
    PetscCall(MatGetFactor(S_, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, factors_.out()));
    PetscCall(count_mumps_pivots(factors_));
    if (percent > 0) PetscCall(MatMumpsSetIcntl(factors_, MUMPS_WORK_SPACE, percent));
    PetscCall(MatFactorInfoInitialize(&info));
    PetscCall(MatCholeskyFactorSymbolic(factors_, S_, nullptr, &info));
    PetscCall(MatFactorGetError(factors_, &failed));
    if (failed != MAT_FACTOR_NOERROR) PetscFunctionReturn(0);
    PetscCall(MatCholeskyFactorNumeric(factors_, S_, &info));
    PetscCall(MatFactorGetError(factors_, &failed));
    PetscCall(wider_work_space(factors_, &percent));
  } while (percent > 0);
  *good = failed == MAT_FACTOR_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::negative_pivots(PetscInt* count) const {
  PetscInt zero = 0, positive = 0;
  PetscFunctionBegin;
  PetscCall(MatGetInertia(factors_, count, &zero, &positive));
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::solve(Vec r, Vec z) {
  PetscFunctionBegin;
  get_half(r, StateHalf::velocity, WriteArray(b_));
  PetscCall(MatSolve(factors_, b_, w_));
  PetscCall(VecZeroEntries(z));
  set_half(z, StateHalf::position, ReadArray(w_));
  PetscFunctionReturn(0);
}

namespace {

constexpr std::size_t KEPT = 60;  // directions
constexpr double SLOW = 0.5;

}  // namespace

PetscErrorCode TangentSolve::prepare(TS ts, Mat J, Equilibrium& model, double t, Vec y) {
  constexpr double RTOL = 1e-10;
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
  PetscCall(VecDuplicate(y, r_.out()));
  force_.resize(static_cast<std::size_t>(model.mechanics()->layout().particles * model.dim()));
  PetscFunctionReturn(0);
}

/// Where there are none the linear solver of the run remains.
PetscErrorCode TangentSolve::factor() {
  constexpr double SHIFT = 1e-9;
  bool good = false;
  PetscFunctionBegin;
  if (factored_) PetscFunctionReturn(0);
  PetscCall(factors_.create(model_->mechanics()->linearisation()));
  if (factors_.mean() > 0) PetscCall(factors_.factor(SHIFT * factors_.mean(), &good));
  direct_ = factored_ = good;
  PetscCall(factors_.memory_lack(&lack_));
  PetscFunctionReturn(0);
}

PetscErrorCode TangentSolve::restore_solver() {
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(condensed_set_tangent(pc, model_->tangent(), demand_));
  PetscCall(condensed_renew(pc));
  PetscCall(KSPSetTolerances(ksp_, rtol_, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

// w = -K z_x in the places of v
PetscErrorCode TangentSolve::product(Vec z, Vec w) {
  PetscFunctionBegin;
  PetscCall(model_->mechanics()->linearisation().change_of_force(z, force_.data()));
  PetscCall(VecZeroEntries(w));
  set_half(w, StateHalf::velocity, force_.data(), -1);
  PetscFunctionReturn(0);
}

// z = (shift M - K)^-1 r, less what makes w = -K z orthogonal to the `count` directions kept; both divided by |w|, which is returned relative to what
// it was before: 0 where z is nothing new
PetscErrorCode TangentSolve::add_direction(std::size_t count, double* length) {
  constexpr double NOTHING = 1e-13;
  PetscReal before = 0, after = 0;
  PetscFunctionBegin;
  const std::size_t at = count % KEPT;
  if (z_.size() <= at) {
    z_.resize(at + 1);
    w_.resize(at + 1);
    PetscCall(VecDuplicate(r_, z_[at].out()));
    PetscCall(VecDuplicate(r_, w_[at].out()));
  }
  PetscCall(direct_ ? factors_.solve(r_, z_[at]) : KSPSolve(ksp_, r_, z_[at]));
  PetscCall(zero_velocities(z_[at]));
  PetscCall(product(z_[at], w_[at]));
  PetscCall(VecNorm(w_[at], NORM_2, &before));
  for (std::size_t k = 0; k < std::min(count, KEPT); ++k) {
    PetscScalar part = 0;
    if (k == at) continue;
    PetscCall(VecDot(w_[at], w_[k], &part));
    PetscCall(VecAXPY(w_[at], -part, w_[k]));
    PetscCall(VecAXPY(z_[at], -part, z_[k]));
  }
  PetscCall(VecNorm(w_[at], NORM_2, &after));
  *length = after > NOTHING * before ? after / before : std::isnan(after) ? after : 0;
  if (*length > 0) {
    PetscCall(VecScale(w_[at], 1 / after));
    PetscCall(VecScale(z_[at], 1 / after));
  }
  PetscFunctionReturn(0);
}

// r = f + K u with the exact K, until r is down to rounding: neither the shift nor the precision in which the matrix is stored is left in u
PetscErrorCode TangentSolve::iterate(Vec load, Vec u, double* left) {
  constexpr int MOST = 200;
  const int patience = direct_ ? 20 : 2;
  const double done = rough_ ? 2 * ROUGH : 1e-13;
  PetscReal first = 0, size = 0, least = 0;
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(u));
  PetscCall(VecCopy(load, r_));
  PetscCall(VecNorm(load, NORM_2, &first));
  size = least = first;
  int waited = 0;
  for (std::size_t pass = 0; pass < MOST && size > done * first && waited < patience; ++pass) {
    PetscScalar part = 0;
    double length = 0;
    PetscCall(add_direction(pass, &length));
    if (!(length > 0)) {
      if (std::isnan(length)) size = length;
      break;
    }
    PetscCall(VecDot(r_, w_[pass % KEPT], &part));
    PetscCall(VecAXPY(u, part, z_[pass % KEPT]));
    PetscCall(product(u, r_));
    PetscCall(VecAYPX(r_, -1.0, load));
    PetscCall(VecNorm(r_, NORM_2, &size));
    waited = size < SLOW * least ? 0 : waited + 1;
    least = std::min(least, size);
  }
  *left = size / first;
  PetscFunctionReturn(0);
}

PetscErrorCode TangentSolve::solve(Vec load, Vec u, double enough, double* left) {
  PetscReal first = 0;
  PetscFunctionBegin;
  *left = -1;
  PetscCall(VecZeroEntries(u));
  PetscCall(VecZeroEntries(r_));
  PetscCall(VecNorm(load, NORM_2, &first));
  if (first == 0) PetscFunctionReturn(0);
  if (direct_) PetscCall(factor());
  PetscCall(iterate(load, u, left));
  if (*left <= enough || direct_) PetscFunctionReturn(0);
  PetscCall(factor());
  if (direct_) PetscCall(iterate(load, u, left));
  if (direct_ || lack_.yes) PetscFunctionReturn(0);
  PC pc;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(find_memory_lack(model_->comm(), pc, &lack_));
  PetscFunctionReturn(0);
}

}  // namespace bs
