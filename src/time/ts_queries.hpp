// Queries on a TS that several parts of the solver need.
#pragma once
#include <petscts.h>
#include "base/rounding.hpp"

namespace bs {

/// Whether steps follow an error estimate (-ts_adapt_type other than none).
PetscErrorCode is_adaptive(TS ts, bool* yes);

/// The linear solver of an implicit type and its preconditioner, both borrowed; either may be null.
PetscErrorCode linear_solver_of(TS ts, KSP* ksp, PC* pc);

/// Collective. Whether the last set-up of the linear solver failed, on any rank, for lack of memory.
PetscErrorCode linear_solver_lacks_memory(TS ts, bool* yes);

}  // namespace bs
