// The task "statics": equilibria under loads that grow in steps.
#pragma once
#include <memory>
#include "systems/model.hpp"

namespace bs {

/// Collective. As run_model; the trajectory has a frame and the log a row for every load step, at its load factor.
PetscErrorCode run_statics(std::unique_ptr<Model> model, int* exit_code);

}  // namespace bs
