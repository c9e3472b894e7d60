// When Newton has converged: kinematic and momentum residual are judged apart, since their units differ.
#pragma once
#include <petscsnes.h>
#include "model/model.hpp"

namespace bs {

/// Lives as long as the SNES it is set on; `floor` is renewed before every step.
struct ConvergenceTest {
  Model* model = nullptr;
  ResidualNorms floor;        ///< rounding errors of the residual
  ResidualNorms first;        ///< of the first iterate
  PetscErrorCode attach(SNES snes);
};

}  // namespace bs
