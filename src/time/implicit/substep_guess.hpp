// The first iterate of Newton's method where sheets fold: a motion downhill in the step's potential, in linearly implicit sub-steps.
#pragma once
#include <petscts.h>
#include <vector>
#include "base/handle.hpp"
#include "systems/model.hpp"

namespace bs {

/// From an unstable state every Newton iteration at best doubles the amplitude of a buckle; with inertia it grows without a bound on the ratio, and
/// by systems that are positive definite. With x_hat = x + u/s, s = 4 sigma, x(v) and Phi those of the step (systems/incremental.hpp), a sub-step is
///   S w = dPhi/dv at x_hat,   u <- u - w,   x <- x + u/s,   S = s M - D - K/s, its definite part
/// starting at x_n with u = v_n. Where Phi has risen it goes on from the lowest place at rest. The guess is the lowest place.
class SubstepGuess {
 public:
  /// `theta` is that of the type. The solver of `ts` is to be set up when the guess is made.
  void attach(TS ts, Model& model, double theta, PetscInt most);
  /// Why there are none of this solver: empty if there are.
  static PetscErrorCode missing(TS ts, Model& model, const char** why);
  /// Collective. X becomes the guess for the step that starts at y.
  PetscErrorCode make(SNES snes, Vec y, Vec X);
  std::int64_t taken() const { return taken_; }  ///< sub-steps so far

 private:
  PetscErrorCode begin(Vec y, Vec X);
  PetscErrorCode add_kinematic(Vec y, Vec z) const;
  PetscErrorCode step(SNES snes, Vec y, bool* solved);
  PetscErrorCode change_of_potential(SNES snes, double* change);
  PetscErrorCode descend(SNES snes, Vec y, Vec X);

  TS ts_ = nullptr;
  Model* model_ = nullptr;
  PetscInt most_ = 0;
  std::int64_t taken_ = 0;
  double theta_ = 1;
  double end_ = 0, sigma_ = 1;         ///< of the step: its end [s]; 1/(theta h) [1/s]
  std::vector<double> u_;              ///< by the order of the layout [m/s]
  VecHandle here_, there_, line_, F_;  ///< states before and after a sub-step, their difference, a residual; made at first use
};

}  // namespace bs
