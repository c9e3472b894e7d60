// The task "statics": equilibria under loads that grow in steps.
#pragma once
#include <memory>
#include "systems/model.hpp"
#include "tasks/run_options.hpp"

namespace bs {

/// Collective. As run_model; the trajectory has a frame and the log a row for every load step, at its load factor.
PetscErrorCode run_statics(std::unique_ptr<Model> model, int* exit_code);

/// Collective. The same, and at the last equilibrium the stiffness of a periodic lattice (moduli.hpp).
PetscErrorCode run_moduli(std::unique_ptr<Model> model, int* exit_code);

/// Collective. The same as run_statics without files: `settled` is the model under its full loads, *y a new vector, its equilibrium at rest (under
/// -help the start). As with run_statics, one that is not found ends in ERR_TOLD.
PetscErrorCode settle(std::unique_ptr<Model> model, const RunOptions& options, std::unique_ptr<Model>* settled, Vec* y, int* exit_code);

}  // namespace bs
