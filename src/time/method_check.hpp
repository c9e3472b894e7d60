// Options that are incompatible with a time-stepping method: reported before the first step.
#pragma once
#include "time/ts_setup.hpp"

namespace bs {

/// Collective, after TSSetFromOptions. Ends the run with exit code 2 if an option would make the method crash, or silently lose its order
/// or its error control. A type without an error estimate keeps its step.
PetscErrorCode check_method(TS ts, const TSContext& context);

}  // namespace bs
