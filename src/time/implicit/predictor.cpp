#include "time/implicit/predictor.hpp"
#include <algorithm>
#include <cmath>
#include "systems/layout.hpp"
#include "systems/mechanics.hpp"
#include "time/methods.hpp"

namespace bs {

PetscErrorCode Predictor::attach(TS ts, Model& model, NewtonPolicy* newton) {
  PetscBool end_point = PETSC_TRUE, is = PETSC_FALSE;
  const Method* method;
  PetscReal value = 1;
  SNES snes;
  PetscFunctionBegin;
  ts_ = ts;
  model_ = &model;
  newton_ = newton;
  PetscCall(method_of(ts, &method));
  if (!method->remembers(Memory::theta) || !model.tangent()) PetscFunctionReturn(0);
  PetscCall(theta_of(ts, &value));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ts), TSBEULER, &is));
  if (!is) PetscCall(TSThetaGetEndpoint(ts, &end_point));
  theta_ = value;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESKSPONLY, &is));
  if (!end_point || is) PetscFunctionReturn(0);  // a single linear solve is meant to start from the last state
  PetscCall(SNESSetComputeInitialGuess(
      snes, [](SNES of, Vec X, void* self) { return static_cast<Predictor*>(self)->predict(of, X); }, this));
  PetscFunctionReturn(0);
}

PetscErrorCode Predictor::predict(SNES snes, Vec X) {
  const PetscScalar *a0 = nullptr, *a1 = nullptr;
  PetscScalar* at = nullptr;
  PetscReal h;
  double last_h = 0;
  Vec F, y;
  PetscFunctionBegin;
  Vec before = history_ && !history_->replaying() ? history_->before_last(&last_h) : nullptr;
  const bool first = !before && model_->mechanics() && model_->mechanics()->flows();  // before the first step, too
  if (!before && !first) PetscFunctionReturn(0);
  ResidualNorms here, ahead;
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(SNESGetFunction(snes, &F, nullptr, nullptr));  // room that Newton fills anew
  PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(model_->residual_norms(F, &here));
  const double ratio = first ? 0 : h / last_h;
  if (first) before = y;
  PetscCall(VecGetArrayRead(before, &a0));
  PetscCall(VecGetArrayRead(y, &a1));
  PetscCall(VecGetArray(X, &at));
  layout_of(X).for_each([&](PetscInt x, PetscInt v) {
    at[v] = a1[v] + ratio * (a1[v] - a0[v]);
    at[x] = a1[x] + h * ((1 - theta_) * a1[v] + theta_ * at[v]);
  });
  PetscCall(VecRestoreArray(X, &at));
  PetscCall(VecRestoreArrayRead(y, &a1));
  PetscCall(VecRestoreArrayRead(before, &a0));
  PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(model_->residual_norms(F, &ahead));
  const double start = std::max(here[0] / (theta_ * h), here[1]), there = std::max(ahead[0] / (theta_ * h), ahead[1]);
  PetscCall(PetscInfo(snes, "residual at the last state %g, at the predicted one %g\n", start, there));
  if (std::isfinite(there) && there < 0.5 * start) newton_->set_reference(here);
  else PetscCall(VecCopy(y, X));
  PetscFunctionReturn(0);
}

}  // namespace bs
