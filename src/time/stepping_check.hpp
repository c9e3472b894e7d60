// Numbers of PETSc's own options that PETSc does not check.
#pragma once
#include <petscts.h>

namespace bs {

/// Collective, after TSSetFromOptions. Errors (exit 2): a step that is not positive, times that are not finite or end
/// before they begin, a negative number of steps, theta outside (0, 1], tolerances of Newton that are negative.
PetscErrorCode check_stepping(TS ts, bool implicit);

}  // namespace bs
