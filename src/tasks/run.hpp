// One run from a model to its last frame.
#pragma once
#include <memory>
#include "systems/model.hpp"

namespace bs {

/// Collective. Reads the options of stepping and output, advances `model`, writes trajectory, report and summary.
/// Returns ERR_TOLD where the run failed (exit 3) or could not write (exit 4). `exit_code`: 0, or 128 + signal.
PetscErrorCode run_model(Model& model, int* exit_code);

/// Collective. The task `dynamics`: run_model of a model that it owns.
PetscErrorCode run_dynamics(std::unique_ptr<Model> model, int* exit_code);

}  // namespace bs
