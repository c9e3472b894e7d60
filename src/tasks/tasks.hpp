// What a system can be asked for: one row for each task, chosen by -bs_task.
#pragma once
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>
#include "systems/model.hpp"
#include "tasks/result.hpp"

namespace bs {

/// A task. `run` advances or analyses the model; it returns ERR_FAILED where the task failed (exit 3) or could not write (exit 4), and sets
/// `exit_code`: 0, or 128 + signal; `result`, unless null, receives its numbers. Null: the task has no model, and `make` does all of it.
struct Task {
  const char *name, *what;
  PetscErrorCode (*run)(std::unique_ptr<Model> model, Result* result, int* exit_code);
  PetscErrorCode (*make)(MPI_Comm comm) = nullptr;
};

/// Registers the program's own types of TS, PC and line searches; after PetscInitialize.
PetscErrorCode register_types();

/// All of them; the first is the default.
const std::vector<Task>& tasks();

/// Collective. Makes the model of the options in force and runs the task of -bs_task. An unknown one is exit code 2.
PetscErrorCode run_task(MPI_Comm comm, int* exit_code);

/// A task with one of the kinds of model that it has, as the options name them.
struct Variant {
  const char *task, *model;
};

/// All of them. A task without a model has no option that others have not.
const std::vector<Variant>& variants();

/// Collective. The task reads its options as under -help, `more` (names with their dash, and values) being given, and computes nothing. Those of
/// `more` that it has not asked for stay in `left`, unless that is null.
PetscErrorCode rehearse(MPI_Comm comm, const Variant& variant, const std::vector<std::pair<std::string, std::string>>& more = {},
                        std::set<std::string>* left = nullptr);

}  // namespace bs
