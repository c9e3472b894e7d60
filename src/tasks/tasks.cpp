#include "tasks/tasks.hpp"
#include <string>
#include "base/options.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/newton/search/energy.hpp"
#include "systems/create.hpp"
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
  };
  return all;
}

PetscErrorCode read_task(MPI_Comm comm, const Task** task) {
  int chosen = 0;
  std::string list;
  std::vector<std::string> names;
  PetscFunctionBegin;
  for (const Task& each : tasks()) {
    list += (list.empty() ? "" : "; ") + std::string(each.name) + ": " + each.what;
    names.emplace_back(each.name);
  }
  PetscCall(read_section(comm, "Task", [&](Section& o) {
    o.choice("-bs_task", ("what is computed (" + list + ")").c_str(), names, chosen);
    const Task& one = tasks()[static_cast<std::size_t>(chosen)];
    if (!one.run) o.fail(std::string("option -bs_task ") + one.name + ": this version has no such task yet: write dynamics, or leave the option out");
  }));
  PetscCall(read_mode_options(comm, tasks()[static_cast<std::size_t>(chosen)].run == run_modes));
  *task = &tasks()[static_cast<std::size_t>(chosen)];
  PetscFunctionReturn(0);
}

}  // namespace bs
