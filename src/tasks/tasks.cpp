#include "tasks/tasks.hpp"
#include <string>
#include "base/options.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/newton/search/energy.hpp"
#include "systems/create.hpp"
#include "tasks/generate.hpp"
#include "tasks/modes.hpp"
#include "tasks/run.hpp"
#include "tasks/statics/statics.hpp"
#include "time/methods.hpp"
#include "time/own_type.hpp"

namespace bs {

PetscErrorCode register_types() {
  PetscFunctionBegin;
  PetscCall(register_symplectic());
  PetscCall(register_verlet());
  PetscCall(register_alpha2());
  PetscCall(register_condensed());
  PetscCall(register_models());
  PetscCall(register_searches());
  PetscFunctionReturn(0);
}

const std::vector<Task>& tasks() {
  static const std::vector<Task> all = {
      {"dynamics", "motion in time", run_dynamics},
      {"statics", "equilibria under loads that grow in steps", run_statics},
      {"moduli", "equilibria as in statics, and the stiffness tensor of a periodic lattice at the last one", run_moduli},
      {"modes", "free vibrations about the start: omega^2 and shapes", run_modes},
      {"generate", "the lattice is written as a file, -bs_output F.h5, which -bs_lattice_file reads; nothing is computed", nullptr, write_lattice},
  };
  return all;
}

static PetscErrorCode read_task(MPI_Comm comm, const Task** task) {
  int chosen = 0;
  std::string list;
  std::vector<std::string> names;
  PetscFunctionBegin;
  for (const Task& each : tasks()) {
    list += (list.empty() ? "" : "; ") + std::string(each.name) + ": " + each.what;
    names.emplace_back(each.name);
  }
  PetscCall(read_section(comm, "Task", [&](Section& o) { o.choice("-bs_task", ("what is computed (" + list + ")").c_str(), names, chosen); }));
  *task = &tasks()[static_cast<std::size_t>(chosen)];
  PetscFunctionReturn(0);
}

PetscErrorCode run_task(MPI_Comm comm, int* exit_code) {
  std::unique_ptr<Model> model;
  const Task* task = nullptr;
  PetscFunctionBegin;
  PetscCall(read_task(comm, &task));
  *exit_code = 0;
  if (task->make) PetscFunctionReturn(task->make(comm));
  PetscCall(create_model(comm, &model));
  PetscCall(task->run(std::move(model), nullptr, exit_code));
  PetscFunctionReturn(0);
}

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all = {
      {"dynamics", "particles"}, {"statics", "particles"}, {"moduli", "particles"}, {"modes", "particles"}, {"dynamics", "linear"}};
  return all;
}

PetscErrorCode rehearse(MPI_Comm comm, const Variant& variant, const std::vector<std::pair<std::string, std::string>>& more,
                        std::set<std::string>* left) {
  PetscOptions table = nullptr;
  int unused = 0;
  PetscFunctionBegin;
  PetscCall(PetscOptionsCreate(&table));
  for (const auto& [name, value] : more) PetscCall(PetscOptionsSetValue(table, name.c_str(), value.empty() ? nullptr : value.c_str()));
  for (const auto& [name, value] : {std::pair{"-help", static_cast<const char*>(nullptr)}, {"-bs_task", variant.task}, {"-bs_model", variant.model}})
    PetscCall(PetscOptionsSetValue(table, name, value));
  PetscCall(PetscOptionsPush(table));
  const PetscErrorCode code = run_task(comm, &unused);
  for (const auto& [name, value] : more) {
    PetscBool used = PETSC_FALSE;
    PetscCall(PetscOptionsUsed(table, name.c_str() + 1, &used));
    if (left && !used) left->insert(name);
  }
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&table));
  PetscFunctionReturn(code);
}

}  // namespace bs
