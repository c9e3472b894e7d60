// One run from a model to its last frame.
#pragma once
#include "systems/model.hpp"

namespace bs {

/// Collective. Reads the options of stepping and output, advances `model`, writes trajectory, report and summary.
/// Returns ERR_TOLD where the run failed (exit 3) or could not write (exit 4). `exit_code`: 0, or 128 + signal.
PetscErrorCode run_model(Model& model, int* exit_code);

}  // namespace bs
