// The line of one energy search: the states on F_x = 0 along Newton's direction, and what Phi's slope is there.
#pragma once
#include "solvers/newton/search/energy.hpp"

namespace bs {

/// State of one search. Trials are W = X + lambda line on F_x = 0; a full step is Newton's own in every bit.
struct EnergyLine {
  NewtonPolicy& newton;
  const EnergyLimits& limits;
  Incremental& potential;
  SNES snes = nullptr;
  Vec start = nullptr, Y = nullptr;  ///< Newton's iterate and direction
  Vec X = nullptr, F = nullptr, line = nullptr, W = nullptr, G = nullptr;
  double slope = 0;     ///< F_v . dv at lambda = 0
  double noise = 0;     ///< rounding error of the slope
  PetscReal full = -1;  ///< |G| while W and G are the full step's

  /// Collective. X, F and line from Newton's iterate, its residual and its direction.
  PetscErrorCode set_up(Vec residual);
  /// Collective. The trial state and its residual; `fnorm` not finite: a law has no value there.
  PetscErrorCode evaluate(double lambda, PetscReal* fnorm);
  /// Collective. Phi(lambda) - Phi(0) - lambda slope.
  PetscErrorCode beyond_slope(double lambda, PotentialChange* change) const;
  /// Collective. Whether Phi's slope at the trial is well below that at the start.
  PetscErrorCode slope_is_well(bool* well) const;
  /// Collective. W and G become Newton's iterate and residual.
  PetscErrorCode accept(SNESLineSearch search, Vec residual, PetscReal lambda, PetscReal fnorm) const;
};

}  // namespace bs
