#include "solve/predictor.hpp"
#include <cmath>

namespace bs {

PetscErrorCode Predictor::attach(TS ts, Model& model, NewtonPolicy* newton) {
  PetscBool theta = PETSC_FALSE, end_point = PETSC_TRUE, is = PETSC_FALSE;
  PetscReal value = 1;
  SNES snes;
  PetscFunctionBegin;
  ts_ = ts;
  model_ = &model;
  newton_ = newton;
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(ts), &theta, TSBEULER, TSCN, TSTHETA, ""));
  active_ = theta && model.tangent();
  if (!active_) PetscFunctionReturn(0);
  PetscCall(TSThetaGetTheta(ts, &value));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ts), TSBEULER, &is));
  if (!is) PetscCall(TSThetaGetEndpoint(ts, &end_point));
  theta_ = value;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESKSPONLY, &is));
  active_ = end_point && !is;  // a single linear solve is meant to start from the last state
  if (!active_) PetscFunctionReturn(0);
  PetscCall(SNESSetComputeInitialGuess(snes, guess, this));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::remember(Vec y, double h) {
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  for (VecHandle* vec : {&before_, &last_})
    if (!*vec) PetscCall(VecDuplicate(y, vec->out()));
  std::swap(before_, last_);
  PetscCall(VecCopy(y, last_));
  last_h_ = h;
  known_ = std::min(known_ + 1, 2);
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::guess(SNES snes, Vec X, void* context) {
  PetscFunctionBegin;
  PetscCall(static_cast<Predictor*>(context)->predict(snes, X));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::predict(SNES snes, Vec X) {
  const PetscScalar* a1 = nullptr;
  PetscScalar* at = nullptr;
  PetscReal h, start, there;
  PetscInt local = 0;
  Vec F;
  PetscFunctionBegin;
  if (known_ < 2) PetscFunctionReturn(0);
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(SNESGetFunction(snes, &F, nullptr, nullptr));  // room that Newton fills anew
  const PetscInt d = model_->dim();
  const double ratio = h / last_h_;
  Vec trial = before_;
  known_ = 1;  // the older state is spent; remember() brings the next one
  PetscCall(VecGetLocalSize(X, &local));
  PetscCall(VecGetArrayRead(last_, &a1));
  PetscCall(VecGetArray(trial, &at));
  for (PetscInt i = 0; i < local; i += 2 * d)
    for (PetscInt c = 0; c < d; ++c) {
      const PetscInt x = i + c, v = x + d;
      at[v] = a1[v] + ratio * (a1[v] - at[v]);
      at[x] = a1[x] + h * ((1 - theta_) * a1[v] + theta_ * at[v]);
    }
  PetscCall(VecRestoreArray(trial, &at));
  PetscCall(VecRestoreArrayRead(last_, &a1));
  ResidualNorms here, ahead;
  PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(model_->residual_norms(F, &here));
  PetscCall(SNESComputeFunction(snes, trial, F));
  PetscCall(model_->residual_norms(F, &ahead));
  start = std::max(here[0] / (theta_ * h), here[1]);
  there = std::max(ahead[0] / (theta_ * h), ahead[1]);
  PetscCall(PetscInfo(snes, "residual at the last state %g, at the predicted one %g\n", start, there));
  if (!std::isfinite(there) || there >= 0.5 * start) PetscFunctionReturn(0);
  PetscCall(VecCopy(trial, X));
  newton_->reference = here;
  PetscFunctionReturn(0);
}

}  // namespace bs
