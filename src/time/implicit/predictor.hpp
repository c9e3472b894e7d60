// The initial guess of Newton's method: at the last state, or at the state the last two velocities point to where that is closer.
#pragma once
#include <petscts.h>
#include "solvers/newton/convergence.hpp"
#include "systems/model.hpp"
#include "time/history.hpp"

namespace bs {

/// For the one-step types beuler, cn and theta with end point. With v the velocity and theta the type's:
///   v* = v_n + (v_n - v_(n-1)) h/h_(n-1),  x* = x_n + h ((1 - theta) v_n + theta v*)
/// It is taken if its residual is less than half that at (x_n, v_n): through stiff springs it is far larger.
class Predictor {
 public:
  /// Collective. Hooks into the SNES of `ts` where the type is one of those and the model has positions and velocities.
  PetscErrorCode attach(TS ts, Model& model, NewtonPolicy* newton);
  /// Where the state before the last comes from; without it Newton starts at the last state.
  void set_history(const History* history) { history_ = history; }

 private:
  static PetscErrorCode guess(SNES snes, Vec X, void* context);
  PetscErrorCode predict(SNES snes, Vec X);
  TS ts_ = nullptr;
  Model* model_ = nullptr;
  NewtonPolicy* newton_ = nullptr;
  const History* history_ = nullptr;
  double theta_ = 1;
};

}  // namespace bs
