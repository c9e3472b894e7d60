#include "session/tasks.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "linalg/condensed/condensed.hpp"
#include "session/session_impl.hpp"
#include "solvers/newton/search/energy.hpp"
#include "systems/create.hpp"
#include "tasks/generate.hpp"
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

PetscErrorCode take_up_options(MPI_Comm comm) {
  PetscFunctionBegin;
  PetscCall(register_types());
  PetscCall(recall_options(comm));
  PetscCall(unify_option_names(comm));
  PetscCall(check_viewers(comm));
  PetscCall(check_tolerances(comm));
  PetscFunctionReturn(0);
}

/// One row for each task; the first is the default.
PetscErrorCode Session::Impl::perform(int* exit_code) {
  struct Task {
    const char *name, *what;
    PetscErrorCode (*run)(Impl& own, int* exit_code);
  };
  static const Task all[] = {
      {"dynamics", "motion in time", [](Impl& own, int* code) { return own.dynamics(code); }},
      {"statics", "equilibria under loads that grow in steps",
       [](Impl& own, int* code) { return own.solve_statics(Analyses::compliance, nullptr, code); }},
      {"moduli", "equilibria as in statics, and the stiffness tensor of a periodic lattice at the last one",
       [](Impl& own, int* code) { return own.solve_statics(Analyses::moduli, nullptr, code); }},
      {"modes", "free vibrations about the start: omega^2 and shapes", [](Impl& own, int* code) { return own.modes(nullptr, nullptr, code); }},
      {"generate", "the lattice is written as a file, -bs_output F.h5, which -bs_lattice_file reads; nothing is computed",
       [](Impl& own, int*) { return write_lattice(own.comm, own.given.get()); }},
  };
  int chosen = 0;
  std::string list;
  std::vector<std::string> names;
  PetscFunctionBegin;
  *exit_code = 0;
  PetscCall(take_up_options(comm));
  for (const Task& each : all) {
    list += (list.empty() ? "" : "; ") + std::string(each.name) + ": " + each.what;
    names.emplace_back(each.name);
  }
  PetscCall(read_section(comm, "Task", [&](Section& o) { o.choice("-bs_task", ("what is computed (" + list + ")").c_str(), names, chosen); }));
  PetscCall(all[chosen].run(*this, exit_code));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::perform(MPI_Comm comm, int* exit_code) {
  Impl own;
  own.comm = comm;
  own.borrowed = own.options.in_force = true;
  return own.perform(exit_code);
}

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all = {
      {"dynamics", "particles"}, {"statics", "particles"}, {"moduli", "particles"}, {"modes", "particles"}, {"dynamics", "linear"}};
  return all;
}

PetscErrorCode rehearse(MPI_Comm comm, const Variant& variant, const Settings& more, std::set<std::string>* left) {
  OptionTable table;
  int unused = 0;
  PetscFunctionBegin;
  PetscCall(table.fill(more, {{"-help", ""}, {"-bs_task", variant.task}, {"-bs_model", variant.model}}));
  PetscCall(PetscOptionsPush(table.get()));
  const PetscErrorCode code = Session::perform(comm, &unused);
  for (const auto& [name, value] : more) {
    PetscBool used = PETSC_FALSE;
    PetscCall(PetscOptionsUsed(table.get(), name.c_str() + 1, &used));
    if (left && !used) left->insert(name);
  }
  PetscCall(PetscOptionsPop());
  PetscFunctionReturn(code);
}

}  // namespace bs
