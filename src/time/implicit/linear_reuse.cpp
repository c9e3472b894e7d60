#include "time/implicit/linear_reuse.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/solver_options.hpp"
#include "time/methods.hpp"

namespace bs {

static constexpr double SAME = 1e-12;  // relative: lengths that have one matrix (LinearModel::jacobian)

PetscErrorCode shift_of_step(TS ts, double h, double* sigma) {
  PetscReal theta;
  PetscFunctionBegin;
  PetscCall(theta_of(ts, &theta));
  *sigma = 1 / (theta * h);
  PetscFunctionReturn(0);
}

PetscErrorCode LinearReuse::attach(TS ts, TSContext& context) {
  bool adaptive = false;
  PetscFunctionBegin;
  context_ = &context;
  startup_ = context.model->startup_steps();
  const bool theta_family = context.method->remembers(Memory::theta);
  if (startup_ > 0 && !theta_family)
    PetscCall(fail(context.model->comm(), Exit::input, "option -bs_linear_be_steps: needs -ts_type cn, theta or beuler"));
  if (!context.implicit || !context.model->linear() || !theta_family) PetscFunctionReturn(0);
  PetscCall(TSThetaGetTheta(ts, &theta_));
  now_ = theta_;
  PetscCall(TSGetTimeStep(ts, &nominal_));
  PetscCall(is_adaptive(ts, &adaptive));
  SNES snes;
  PC pc;
  Mat A, P;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetJacobian(snes, &A, &P, nullptr, nullptr));
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(pc)));
  *slots_[0].pc.out() = pc;
  slots_[0].matrix = context.matrix;
  // a free step seldom comes back to a length it had; a matrix-free operator has no matrix to keep
  active_ = !adaptive && A == P && P == context.matrix.get();
  PetscFunctionReturn(0);
}

PetscErrorCode LinearReuse::create_second(TS ts) {
  SNES snes;
  KSP ksp;
  const char* prefix = nullptr;
  PCType type = nullptr;
  MatSolverType solver = nullptr;
  PC pc;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(MatDuplicate(context_->matrix, MAT_SHARE_NONZERO_PATTERN, second_.out()));
  PetscCall(PCGetType(slots_[0].pc, &type));
  PetscCall(PCGetOptionsPrefix(slots_[0].pc, &prefix));
  PetscCall(PCCreate(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), &pc));
  *slots_[1].pc.out() = pc;
  PetscCall(PCSetOptionsPrefix(pc, prefix));
  PetscCall(PCSetType(pc, type));
  PetscCall(PCFactorGetMatSolverType(slots_[0].pc, &solver));
  if (solver) PetscCall(PCFactorSetMatSolverType(pc, solver));
  PetscCall(PCSetFromOptions(pc));
  PetscCall(make_pivots_relative(pc, false));
  slots_[1].matrix = second_;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearReuse::before_step(TS ts, std::int64_t since, double h) {
  PetscFunctionBegin;
  if (startup_ > 0) {
    const double theta = since < startup_ ? 1.0 : theta_;
    if (theta != now_) PetscCall(TSThetaSetTheta(ts, theta));
    now_ = theta;
  }
  if (!active_) PetscFunctionReturn(0);
  const double length = now_ * h, usual = theta_ * nominal_;
  const int wanted = std::abs(length - usual) <= SAME * usual ? 0 : 1;
  double& sigma = slots_[wanted].sigma;
  if (std::abs(1 / length - sigma) > SAME * sigma) sigma = 1 / length;
  PetscCall(use(ts, wanted));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearReuse::use(TS ts, int slot) {
  KSP ksp;
  PetscFunctionBegin;
  if (slot == used_) PetscFunctionReturn(0);
  if (!second_) PetscCall(create_second(ts));
  PetscCall(TSSetIJacobian(ts, slots_[slot].matrix, slots_[slot].matrix, nullptr, nullptr));
  PetscCall(linear_solver_of(ts, &ksp, nullptr));
  PetscCall(KSPSetPC(ksp, slots_[slot].pc));
  used_ = slot;
  PetscFunctionReturn(0);
}

void LinearReuse::save(Facts* facts) const {
  for (int k = 0; k < 2; ++k)
    if (slots_[k].sigma > 0) facts->real["matrix_sigma_" + std::to_string(k)] = slots_[k].sigma;
}

PetscErrorCode LinearReuse::restore(TS ts, const Facts& facts) {
  VecHandle zero;
  KSP ksp;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecDuplicate(y, zero.out()));
  PetscCall(VecZeroEntries(zero));
  for (int k = 1; k >= 0 && active_; --k) {
    const auto saved = facts.real.find("matrix_sigma_" + std::to_string(k));
    if (saved == facts.real.end() || !std::isnormal(saved->second)) continue;
    slots_[k].sigma = saved->second;
    PetscCall(use(ts, k));
    PetscCall(context_->model->jacobian(0, y, zero, saved->second, context_->form, slots_[k].matrix));
    PetscCall(linear_solver_of(ts, &ksp, nullptr));
    PetscCall(KSPSetOperators(ksp, slots_[k].matrix, slots_[k].matrix));
    PetscCall(KSPSetUp(ksp));
  }
  PetscFunctionReturn(0);
}

namespace {

/// Linear models; and where one linear solve is the stage (rosw, ksponly) by a solver of the user's choice. The condensed solve judges
/// its own residual, of the system without positions.
PetscErrorCode wants_check(TS ts, const TSContext& context, bool* wants) {
  SNES snes;
  PC pc;
  PetscBool alone = PETSC_FALSE;
  bool condensed = false;
  CondensedCounts counts;
  PetscFunctionBegin;
  *wants = false;
  if (!context.implicit) PetscFunctionReturn(0);
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESKSPONLY, &alone));
  PetscCall(condensed_counts(pc, &condensed, &counts));
  *wants = context.model->linear() || (alone && !condensed);
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode LinearCheck::attach(TS ts, const TSContext& context) {
  KSP ksp;
  Vec y;
  bool wants = false;
  PetscFunctionBegin;
  PetscCall(wants_check(ts, context, &wants));
  if (!wants) PetscFunctionReturn(0);
  context_ = &context;
  ts_ = ts;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecDuplicate(y, work_.out()));
  PetscCall(linear_solver_of(ts, &ksp, nullptr));
  PetscCall(KSPSetPostSolve(
      ksp, [](KSP of, Vec b, Vec x, void* self) { return static_cast<LinearCheck*>(self)->judge(of, b, x); }, this));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearCheck::judge(KSP ksp, Vec b, Vec x) {
  constexpr double LEAST = 1e-6, OF_TOLERANCE = 100, MOST = 0.1, ROUNDING = 1e3;
  KSPConvergedReason reason;
  PetscBool alone;
  PetscReal rtol, left, size, h;
  Mat A;
  PetscFunctionBegin;
  failed_ = false;
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (reason < 0) PetscFunctionReturn(0);  // it says so itself
  PetscCall(KSPGetTolerances(ksp, &rtol, nullptr, nullptr, nullptr));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ksp), KSPPREONLY, &alone));
  PetscCall(KSPGetOperators(ksp, &A, nullptr));
  PetscCall(MatMult(A, x, work_));
  PetscCall(VecAYPX(work_, -1, b));
  PetscCall(VecNormBegin(work_, NORM_2, &left));
  PetscCall(VecNormBegin(b, NORM_2, &size));
  PetscCall(VecNormEnd(work_, NORM_2, &left));
  PetscCall(VecNormEnd(b, NORM_2, &size));
  const double tolerance = alone ? LEAST : std::clamp(OF_TOLERANCE * rtol, LEAST, MOST);
  // what A y and the right side are rounded to: of the state, estimated before the step, and of x
  if (left <= std::max(tolerance * size, ROUNDING * std::hypot(context_->newton.floor()[0], context_->newton.floor()[1]))) PetscFunctionReturn(0);
  ResidualNorms floor;
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(context_->model->residual_floor(0, x, 1 / h, context_->form, &floor));
  if (left <= ROUNDING * std::hypot(floor[0], floor[1])) PetscFunctionReturn(0);
  failed_ = true;
  residual_ = size > 0 ? left / size : left;
  PetscFunctionReturn(0);
}

}  // namespace bs
