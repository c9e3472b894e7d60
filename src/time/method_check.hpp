// Options that PETSc does not check: impossible numbers, and what does not go with a time-stepping method. Reported before the first step.
#pragma once
#include <petscts.h>
#include "time/ts_setup.hpp"

namespace bs {

/// Collective, after TSSetFromOptions. Ends the run with exit code 2 if an option would make the method crash, or silently lose its order
/// or its error control. A type without an error estimate keeps its step.
PetscErrorCode check_method(TS ts, const TSContext& context);

/// Collective, after TSSetFromOptions. Errors (exit 2): a step that is not positive, times that are not finite or end
/// before they begin, a negative number of steps, theta outside (0, 1], tolerances of Newton that are negative.
PetscErrorCode check_stepping(TS ts, bool implicit);

}  // namespace bs
