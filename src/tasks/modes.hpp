// Free vibrations about the start: -bs_task modes.
#pragma once
#include <memory>
#include "systems/model.hpp"

namespace bs {

/// Collective. Reads -bs_modes and what goes with it, so that every task knows these options; `chosen`: the task is this one.
PetscErrorCode read_mode_options(MPI_Comm comm, bool chosen);

/// Collective. Solves -K q = omega^2 M q for some of its eigenpairs, writes them, the report and the summary.
/// Returns ERR_TOLD where not all of them were found (exit 3) or could not be written (exit 4).
PetscErrorCode run_modes(std::unique_ptr<Model> model, int* exit_code);

}  // namespace bs
