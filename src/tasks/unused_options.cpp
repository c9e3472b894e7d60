#include "tasks/unused_options.hpp"
#include <algorithm>
#include <string>
#include "base/error.hpp"
#include "base/options.hpp"

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
    const std::string name = lower(left[k]);
    if (!read_late(name)) names->push_back("-" + name);
  }
  PetscCall(PetscOptionsLeftRestore(nullptr, &count, &left, &values));
  PetscFunctionReturn(0);
}

PetscErrorCode warn_unused_options(MPI_Comm comm) {
  std::vector<std::string> names;
  PetscFunctionBegin;
  PetscCall(unused_options(&names));
  for (const std::string& name : names)
    PetscCall(warn(comm, "option " + name + " is not used by this run: it is misspelt, or belongs to a solver that is not chosen"));
  PetscFunctionReturn(0);
}

namespace {

struct Family {
  const char *begin, *home;  ///< of its names; what reads them
};

const Family FAMILIES[] = {
    {"-bs_load_", "-bs_task statics"},
    {"-bs_arc_", "-bs_task statics"},
    {"-bs_compliance_", "-bs_task statics"},
    {"-bs_box_stress_rtol", "-bs_task statics"},
    {"-bs_break_follow", "-bs_task statics with springs that break"},
    {"-bs_break_dt", "-bs_task statics with springs that break"},
    {"-bs_break_max_steps", "-bs_task statics with springs that break"},
    {"-bs_break_output_interval", "-bs_task statics with springs that break"},
    {"-bs_stability_", "-bs_task statics"},
    {"-bs_zero_modes_", "-bs_task moduli"},
    {"-bs_linear_", "-bs_model linear"},
    {"-bs_lattice_", "-bs_model particles"},
    {"-bs_group_", "-bs_model particles"},
    {"-bs_motion_", "-bs_model particles"},
    {"-bs_force_", "-bs_model particles"},
    {"-bs_anchor_", "-bs_model particles"},
    {"-bs_spring_", "-bs_model particles"},
    {"-bs_box_", "-bs_model particles"},
    {"-bs_break", "-bs_model particles"},
    {"-bs_gravity", "-bs_model particles"},
};

bool begins(const std::string& name, const char* begin) { return name.rfind(begin, 0) == 0; }

/// Whether the run has read options of the family.
bool is_read(MPI_Comm comm, const Family& family) {
  const std::set<std::string>& known = known_options(comm);
  return std::any_of(known.begin(), known.end(), [&](const std::string& name) { return begins(name, family.begin); });
}

}  // namespace

PetscErrorCode refuse_foreign_options(MPI_Comm comm) {
  PetscInt count = 0;
  char **names = nullptr, **values = nullptr;
  std::string name, home;
  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  for (PetscInt k = 0; k < count && home.empty(); ++k) {
    name = std::string("-") + names[k];
    for (const Family& family : FAMILIES)
      if (home.empty() && begins(name, family.begin) && !is_read(comm, family)) home = family.home;
  }
  PetscCall(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  if (!home.empty())
    PetscCall(fail(comm, Exit::input, "option " + name + " does not go with this run: it is of " + home + ": leave it out, or give that"));
  PetscFunctionReturn(0);
}

}  // namespace bs
