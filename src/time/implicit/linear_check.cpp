#include "time/implicit/linear_check.hpp"
#include <algorithm>
#include <cmath>
#include "linalg/condensed/condensed.hpp"
#include "time/methods.hpp"

namespace bs {

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
  PetscCall(KSPSetPostSolve(ksp, after_solve, this));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearCheck::after_solve(KSP ksp, Vec b, Vec x, void* self) {
  PetscFunctionBegin;
  PetscCall(static_cast<LinearCheck*>(self)->judge(ksp, b, x));
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
