#include "time/replay.hpp"

namespace bs {

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
  SNES snes;
  DM dm;
  TSAdapt adapt;
  Vec y;
  PetscFunctionBegin;
  ts_ = ts;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(snes)));
  *own_.out() = snes;
  PetscCall(SNESCreate(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), knowing_.out()));
  PetscCall(SNESSetType(knowing_, SNESSHELL));
  PetscCall(SNESShellSetContext(knowing_, this));
  PetscCall(SNESShellSetSolve(knowing_, answer));
  PetscCall(TSGetDM(ts, &dm));
  PetscCall(SNESSetDM(knowing_, dm));
  PetscCall(TSSetSNES(ts, knowing_));
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetAlwaysAccept(adapt, PETSC_TRUE));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecDuplicate(y, present_.out()));
  PetscCall(VecDuplicate(y, residual_.out()));
  PetscCall(VecCopy(y, present_));
  PetscCall(TSGetStepNumber(ts, &steps_));
  PetscFunctionReturn(0);
}

PetscErrorCode Replay::take_step(double time, double h, Vec y) {
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
  PetscCall(take_step(time, h, y));
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
