// Queries on a TS that several parts of the solver need.
#pragma once
#include <petscts.h>
#include "base/rounding.hpp"

namespace bs {

/// Whether steps follow an error estimate (-ts_adapt_type other than none).
PetscErrorCode is_adaptive(TS ts, bool* yes);

/// The linear solver of an implicit type and its preconditioner, both borrowed; either may be null.
PetscErrorCode linear_solver_of(TS ts, KSP* ksp, PC* pc);

}  // namespace bs
