// Options that PETSc does not check: impossible numbers, and what does not go with a time-stepping method. Reported before the first step.
#pragma once
#include <petscts.h>
#include "systems/model.hpp"
#include "time/ts_setup.hpp"

namespace bs {

/// Collective, after TSSetFromOptions. Ends the run with exit code 2 if an option would make the method crash, or silently lose its order
/// or its error control. A type without an error estimate keeps its step.
PetscErrorCode check_method(TS ts, const TSContext& context);

/// Collective, after TSSetFromOptions. Errors (exit 2): a step that is not positive, times that are not finite or end
/// before they begin, a negative number of steps, theta outside (0, 1], tolerances of Newton that are negative.
PetscErrorCode check_stepping(TS ts, bool implicit);

// Tolerances of error-controlled steps, apart for positions and velocities, whose units differ.

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
