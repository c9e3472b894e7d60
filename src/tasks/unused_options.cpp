#include "tasks/unused_options.hpp"
#include <algorithm>
#include <cstdarg>
#include <map>
#include <set>
#include <string>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "session/inside.hpp"

namespace bs {

namespace {

/// PETSc reads these only when it ends, or prints by them at points of the run still ahead.
bool read_late(const std::string& name) {
  for (const char* part : {"view", "monitor", "converged_reason", "options_left", "log_", "malloc", "objects_dump", "citations", "memory",
                           "get_total_flops", "on_error", "saws", "help", "trace", "info", "mat_mumps", "options_file"})
    if (name.find(part) != std::string::npos) return true;
  return false;
}

}  // namespace

PetscErrorCode unused_options(std::vector<std::string>* names) {
  PetscInt count = 0;
  char **left = nullptr, **values = nullptr;
  PetscFunctionBegin;
  names->clear();
  PetscCall(PetscOptionsLeftGet(nullptr, &count, &left, &values));
  for (PetscInt k = 0; k < count; ++k) {
    if (!read_late(lower(left[k]))) names->push_back(std::string("-") + left[k]);
  }
  PetscCall(PetscOptionsLeftRestore(nullptr, &count, &left, &values));
  PetscFunctionReturn(0);
}

namespace {

/// What was found out of options that the run has no use for.
struct TasksOfOptions {
  std::map<std::string, std::string> of;  ///< name in small letters: which tasks or which model have it
};

const char DYNAMICS[] = "-bs_task dynamics", UNUSED[] = "unused_options";

PetscErrorCode print_nothing(FILE*, const char[], va_list) { return 0; }

/// Collective. The program's options that a task reads, by a rehearsal that prints nothing and that leaves no trace in `comm`. `left`: as of
/// rehearse; all of `more` where the task refuses them.
PetscErrorCode options_of(MPI_Comm comm, const Variant& variant, std::set<std::string>* names, const Settings& more = {},
                          std::set<std::string>* left = nullptr) {
  const auto printing = PetscVFPrintf;
  PetscFunctionBegin;
  MPI_Comm own = own_communicator(comm, nullptr);
  PetscVFPrintf = print_nothing;
  {
    const PetscErrors errors(own);
    if (rehearse(own, variant, more, left) && left)
      for (const auto& [name, value] : more) left->insert(name);
  }
  PetscVFPrintf = printing;
  *names = known_options(own);
  PetscCallMPI(MPI_Comm_free(&own));
  PetscFunctionReturn(0);
}

/// "-bs_task statics or moduli", "-bs_model linear".
std::string home_of(const std::string& name, const std::vector<std::set<std::string>>& known) {
  std::string tasks;
  std::size_t count = 0, all = 0;
  for (std::size_t k = 0; k < known.size(); ++k) {
    const bool particles = variants()[k].model == std::string("particles");
    all += particles;
    if (!is_listed(known[k], name)) continue;
    if (!particles && count == 0) return std::string("-bs_model ") + variants()[k].model;
    if (particles) tasks += (count++ == 0 ? "-bs_task " : " or ") + std::string(variants()[k].task);
  }
  return count == all ? "-bs_model particles" : tasks;
}

/// Collective. Those of PETSc's options that a run of `other` with all of them would use are its own.
PetscErrorCode find_in(MPI_Comm comm, const Variant& other) {
  Settings all, petsc;
  std::set<std::string> left, known;
  PetscFunctionBegin;
  PetscCall(options_in_force(&all));
  for (const auto& [name, value] : all)
    if (lower(name).rfind("bs_", 0) != 0 && !read_late(lower(name))) petsc.emplace_back("-" + name, value);
  PetscCall(options_of(comm, other, &known, petsc, &left));
  for (const auto& one : petsc)
    if (left.count(one.first) == 0) held_by<TasksOfOptions>(comm).of[lower(one.first)] = std::string("-bs_task ") + other.task;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode warn_unused_options(MPI_Comm comm, const Variant& other) {
  std::vector<std::string> names;
  std::map<std::string, std::vector<std::string>> with;
  PetscFunctionBegin;
  PetscCall(unused_options(&names));
  if (other.task && ask_rank_0(comm, [&names] { return !names.empty(); })) PetscCall(find_in(comm, other));
  const auto& homes = held_by<TasksOfOptions>(comm).of;
  for (const std::string& name : names)
    if (const auto home = homes.find(lower(name)); home != homes.end()) with[home->second].push_back(name);
    else PetscCall(warn(comm, UNUSED, "option " + name + " is not used by this run: it is misspelt, or belongs to a solver that is not chosen"));
  for (const auto& [home, of] : with) {
    std::string list;
    for (const std::string& name : of) list += (list.empty() ? "" : ", ") + name;
    PetscCall(warn(comm, UNUSED,
                   of.size() > 1 ? "options " + list + " are not used by this run: they are of " + home
                                 : "option " + list + " is not used by this run: it is of " + home));
  }
  PetscFunctionReturn(0);
}

/// Collective. What each of variants() knows. Error (exit 2): an option that no task knows.
static PetscErrorCode find_known(MPI_Comm comm, std::vector<std::set<std::string>>* known) {
  std::set<std::string> all;
  PetscFunctionBegin;
  for (const Variant& variant : variants()) {
    known->emplace_back();
    PetscCall(options_of(comm, variant, &known->back()));
    all.insert(known->back().begin(), known->back().end());
  }
  PetscCall(reject_unknown_options(comm, all));
  PetscFunctionReturn(0);
}

PetscErrorCode refuse_misspelt_options(MPI_Comm comm) {
  std::vector<std::string> names;
  std::vector<std::set<std::string>> known;
  PetscFunctionBegin;
  PetscCall(unused_options(&names));
  if (ask_rank_0(comm, [&names] { return !names.empty(); })) PetscCall(find_known(comm, &known));
  PetscFunctionReturn(0);
}

PetscErrorCode warn_of_run_options(MPI_Comm comm) {
  std::vector<std::string> names;
  std::vector<std::set<std::string>> known;
  std::string list;
  PetscFunctionBegin;
  PetscCall(unused_options(&names));
  if (!ask_rank_0(comm, [&names] { return !names.empty(); })) PetscFunctionReturn(0);
  PetscCall(find_known(comm, &known));
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  PetscCall(warn(comm, UNUSED,
                 (names.size() > 1 ? "options " + list + " are" : "option " + list + " is") +
                     " not kept by the lattice file: give what belongs to a run with -bs_lattice_file"));
  PetscFunctionReturn(0);
}

PetscErrorCode refuse_foreign_options(MPI_Comm comm) {
  std::vector<std::string> names;
  std::vector<std::set<std::string>> known;
  PetscFunctionBegin;
  PetscCall(unused_options(&names));
  names.erase(std::remove_if(names.begin(), names.end(), [](const std::string& name) { return lower(name).rfind("-bs_", 0) != 0; }), names.end());
  if (!ask_rank_0(comm, [&names] { return !names.empty(); })) PetscFunctionReturn(0);
  PetscCall(find_known(comm, &known));
  for (const std::string& name : names) {
    const std::string home = home_of(name, known);
    if (home.rfind(DYNAMICS, 0) != 0)
      PetscCall(fail(comm, Exit::input, "option " + name + " does not go with this run: it is of " + home + ": leave it out, or give that"));
    held_by<TasksOfOptions>(comm).of[lower(name)] = home;
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
