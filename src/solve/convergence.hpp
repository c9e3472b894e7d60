// When Newton has converged and how far it goes along a step: the kinematic and the momentum residual are judged apart,
// since their units differ.
#pragma once
#include <petscts.h>
#include "model/model.hpp"

namespace bs {

/// Convergence test and line search of one SNES; must outlive it. `floor` is renewed before every step.
struct NewtonPolicy {
  Model* model = nullptr;
  ResidualNorms floor = {0, 0};     ///< rounding errors of the residual
  ResidualNorms first = {0, 0};     ///< residual at the first iterate of this solve
  ResidualNorms previous = {0, 0};  ///< at the iterate before this one
  ResidualNorms reference = {0, 0}; ///< residual where the step began, if Newton starts elsewhere (0: it does not)
  double sigma = 1;                 ///< 1/h of this attempt [1/s]: makes the kinematic residual a force
  /// Whether linear solves are as loose as Newton allows (set for the iterative condensed solve).
  bool forcing = false;
  /// Sets the test, and the line search unless -snes_linesearch_type or another -snes_type is asked for.
  PetscErrorCode attach(TS ts, SNES snes);
  TS ts = nullptr;
};

}  // namespace bs
