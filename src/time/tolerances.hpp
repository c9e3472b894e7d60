// Tolerances of error-controlled steps, apart for positions and velocities, whose units differ.
#pragma once
#include <petscts.h>
#include "systems/model.hpp"

namespace bs {

struct Tolerances {
  double atol_x = 0, atol_v = 0;  ///< -bs_atol_x [m], -bs_atol_v [m/s]; 0: -ts_atol
  double rtol_x = 0, rtol_v = 0;  ///< -bs_rtol_x, -bs_rtol_v; 0: -ts_rtol
  bool given() const { return atol_x > 0 || atol_v > 0 || rtol_x > 0 || rtol_v > 0; }
};

/// Reads the options.
PetscErrorCode read_tolerances(MPI_Comm comm, Tolerances* out);

/// Collective. Applies them to `ts`, whose own tolerances are set. Ends the run with exit code 2 for a model without particles.
PetscErrorCode set_tolerances(const Tolerances& tolerances, const Model& model, TS ts);

}  // namespace bs
