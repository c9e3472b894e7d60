// Options that a time-stepping method cannot go with: told before the first step.
#pragma once
#include "time/ts_setup.hpp"

namespace bs {

/// Collective, after TSSetFromOptions. Told (exit 2) where an option would make the method crash, lose its order or its error
/// control without a word. A type without an error estimate keeps its step.
PetscErrorCode check_method(TS ts, const TSContext& context);

}  // namespace bs
