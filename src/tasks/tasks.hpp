// What a system can be asked for: one row for each task, chosen by -bs_task.
#pragma once
#include <memory>
#include <vector>
#include "systems/model.hpp"
#include "tasks/result.hpp"

namespace bs {

/// A task. `run` advances or analyses the model; it returns ERR_FAILED where the task failed (exit 3) or could not write (exit 4), and sets
/// `exit_code`: 0, or 128 + signal; `result`, unless null, receives its numbers. Null: not built in this version.
struct Task {
  const char *name, *what;
  PetscErrorCode (*run)(std::unique_ptr<Model> model, Result* result, int* exit_code);
};

/// Registers the program's own types of TS, PC and line searches; after PetscInitialize.
PetscErrorCode register_types();

/// All of them; the first is the default.
const std::vector<Task>& tasks();

/// Collective. The task of -bs_task. An unknown one, or one that is not built, ends the run with exit code 2.
PetscErrorCode read_task(MPI_Comm comm, const Task** task);

}  // namespace bs
