#include "time/starter.hpp"
#include "solvers/own_solve.hpp"
#include "time/own_type.hpp"

namespace bs {

/// A solver whose solve is `solve` stands in the place of that of `ts`, which `own` keeps.
static PetscErrorCode stand_in(TS ts, PetscErrorCode (*solve)(SNES, Vec), void* context, SNESHandle* own, SNESHandle* other) {
  SNES snes;
  DM dm;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(snes)));
  *own->out() = snes;
  PetscCall(SNESCreate(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), other->out()));
  PetscCall(SNESSetType(*other, SNESSHELL));
  PetscCall(SNESShellSetContext(*other, context));
  PetscCall(SNESShellSetSolve(*other, solve));
  PetscCall(TSGetDM(ts, &dm));
  PetscCall(SNESSetDM(*other, dm));
  PetscCall(TSSetSNES(ts, *other));
  PetscFunctionReturn(0);
}

PetscErrorCode Starter::begin(TS ts, PetscInt order) {
  KSP ksp;
  Vec y;
  PetscFunctionBegin;
  ts_ = ts;
  columns_ = static_cast<int>(order) - 1;
  PetscCall(stand_in(ts, solve, this, &own_, &starting_));
  PetscCall(SNESGetKSP(own_, &ksp));  // who asks for the linear solver of `ts` gets the one that works
  PetscCall(SNESSetKSP(starting_, ksp));
  PetscCall(TSGetSolution(ts, &y));
  for (VecHandle* vec : {&before_, &rate_, &sum_}) PetscCall(VecDuplicate(y, vec->out()));
  PetscFunctionReturn(0);
}

PetscErrorCode Starter::end() {
  PetscFunctionBegin;
  PetscCall(TSSetSNES(ts_, own_));
  *this = Starter();
  PetscFunctionReturn(0);
}

PetscErrorCode Starter::slope(Vec x) {
  PetscFunctionBegin;
  PetscCall(VecWAXPY(rate_, -1, before_, x));
  PetscCall(VecScale(rate_, 1 / part_));
  PetscFunctionReturn(0);
}

// F(t, x, (x - x_0)/part)
PetscErrorCode Starter::residual(SNES, Vec x, Vec F, void* self) {
  Starter* starter = static_cast<Starter*>(self);
  PetscFunctionBegin;
  PetscCall(starter->slope(x));
  PetscCall(TSComputeIFunction(starter->ts_, starter->time_, x, starter->rate_, F, PETSC_FALSE));
  PetscFunctionReturn(0);
}

PetscErrorCode Starter::jacobian(SNES, Vec x, Mat A, Mat P, void* self) {
  Starter* starter = static_cast<Starter*>(self);
  PetscFunctionBegin;
  PetscCall(starter->slope(x));
  PetscCall(TSComputeIJacobian(starter->ts_, starter->time_, x, starter->rate_, 1 / starter->part_, A, P, PETSC_FALSE));
  PetscFunctionReturn(0);
}

/// Backward Euler from before_ to x at time_, both of this part.
PetscErrorCode Starter::solve_part(Vec x, bool* good) {
  SNESConvergedReason reason;
  PetscInt newton, krylov;
  PetscBool accepted = PETSC_TRUE;
  PetscFunctionBegin;
  PetscCall(VecCopy(before_, x));
  PetscCall(SNESSolve(own_, nullptr, x));
  PetscCall(SNESGetConvergedReason(own_, &reason));
  PetscCall(SNESGetIterationNumber(own_, &newton));
  PetscCall(SNESGetLinearSolveIterations(own_, &krylov));
  newton_ += newton;
  krylov_ += krylov;
  if (reason > 0 && ts_->adapt->checkstage) PetscCall(ts_->adapt->checkstage(ts_->adapt, ts_, time_, x, &accepted));
  *good = reason > 0 && accepted;
  PetscCall(SNESSetConvergedReason(starting_, *good || reason < 0 ? reason : SNES_DIVERGED_LINEAR_SOLVE));
  PetscFunctionReturn(0);
}

/// T_j for j = count.
PetscErrorCode Starter::solve_parts(Vec x, int count, bool* good) {
  PetscReal start;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts_, &start));
  PetscCall(TSGetSolution(ts_, &y));
  part_ = (goal_ - start) / count;
  PetscCall(VecCopy(y, before_));
  for (int k = 1; k <= count; ++k) {
    time_ = k == count ? goal_ : start + k * part_;
    PetscCall(solve_part(x, good));
    if (!*good) break;
    PetscCall(VecCopy(x, before_));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Starter::extrapolate(Vec x, bool* good) {
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(sum_));
  for (int j = 1; j <= columns_; ++j) {
    double weight = 1;
    for (int i = 1; i <= columns_; ++i)
      if (i != j) weight *= static_cast<double>(j) / (j - i);
    PetscCall(solve_parts(x, j, good));
    if (!*good) PetscFunctionReturn(0);
    PetscCall(VecAXPY(sum_, weight, x));
  }
  PetscCall(VecCopy(sum_, x));
  PetscFunctionReturn(0);
}

PetscErrorCode Starter::solve(SNES snes, Vec x) {
  void* context = nullptr;
  bool good = false;
  PetscErrorCode (*jacobian_of)(SNES, Vec, Mat, Mat, void*) = nullptr;
  PetscFunctionBegin;
  PetscCall(SNESShellGetContext(snes, &context));
  Starter* self = static_cast<Starter*>(context);
  self->newton_ = self->krylov_ = 0;
  PetscCall(SNESGetJacobian(self->own_, nullptr, nullptr, &jacobian_of, nullptr));
  const bool ours = jacobian_of == SNESTSFormJacobian;  // not where differences stand in for it
  PetscCall(SNESSetFunction(self->own_, nullptr, residual, self));
  if (ours) PetscCall(SNESSetJacobian(self->own_, nullptr, nullptr, jacobian, self));
  PetscCall(self->extrapolate(x, &good));
  PetscCall(SNESSetFunction(self->own_, nullptr, SNESTSFormFunction, self->ts_));
  if (ours) PetscCall(SNESSetJacobian(self->own_, nullptr, nullptr, SNESTSFormJacobian, self->ts_));
  // what TS adds to its counts
  snes->iter = self->newton_;
  snes->linear_its = self->krylov_;
  PetscFunctionReturn(0);
}

PetscErrorCode Replay::answer(SNES snes, Vec x) {
  void* context = nullptr;
  PetscFunctionBegin;
  PetscCall(SNESShellGetContext(snes, &context));
  Replay& self = *static_cast<Replay*>(context);
  PetscCheck(self.asked_ < self.answers_.size(), PETSC_COMM_SELF, PETSC_ERR_PLIB, "the method solves more often than it did");
  PetscCall(VecCopy(self.answers_[self.asked_++], x));
  // methods that compute their rate along with the residual want one at the answer
  if (self.asked_ == self.answers_.size()) PetscCall(SNESComputeFunction(snes, x, self.residual_));
  PetscFunctionReturn(0);
}

PetscErrorCode Replay::begin(TS ts) {
  TSAdapt adapt;
  Vec y;
  PetscFunctionBegin;
  ts_ = ts;
  PetscCall(stand_in(ts, answer, this, &own_, &knowing_));
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetAlwaysAccept(adapt, PETSC_TRUE));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecDuplicate(y, present_.out()));
  PetscCall(VecDuplicate(y, residual_.out()));
  PetscCall(VecCopy(y, present_));
  PetscCall(TSGetStepNumber(ts, &steps_));
  PetscFunctionReturn(0);
}

PetscErrorCode Replay::repeat_step(double time, double h, Vec y) {
  Vec solution;
  TSConvergedReason reason;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts_, &solution));
  PetscCall(VecCopy(y, solution));
  PetscCall(TSSetTime(ts_, time));
  PetscCall(TSSetTimeStep(ts_, h));
  asked_ = 0;
  PetscCall(TSStep(ts_));
  PetscCall(TSGetConvergedReason(ts_, &reason));
  PetscCheck(reason >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "a step of the past failed: %s", TSConvergedReasons[reason]);
  PetscFunctionReturn(0);
}

PetscErrorCode Replay::step(double time, double h, Vec y, Vec half, Vec end) {
  PetscFunctionBegin;
  answers_.clear();
  if (half) answers_.push_back(half);
  answers_.push_back(end);
  PetscCall(repeat_step(time, h, y));
  PetscFunctionReturn(0);
}

PetscErrorCode Replay::end(double time, double h) {
  Vec solution;
  TSAdapt adapt;
  PetscFunctionBegin;
  PetscCall(TSSetSNES(ts_, own_));
  PetscCall(TSGetAdapt(ts_, &adapt));
  PetscBool always = PETSC_FALSE;
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-ts_adapt_always_accept", &always, nullptr));
  PetscCall(TSAdaptSetAlwaysAccept(adapt, always));
  PetscCall(TSGetSolution(ts_, &solution));
  PetscCall(VecCopy(present_, solution));
  PetscCall(TSSetTime(ts_, time));
  PetscCall(TSSetTimeStep(ts_, h));
  PetscCall(TSSetStepNumber(ts_, steps_));
  PetscFunctionReturn(0);
}

}  // namespace bs
