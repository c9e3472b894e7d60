#include "tasks/unused.hpp"
#include <algorithm>
#include "base/fault.hpp"

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
    std::string name = left[k];
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
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

}  // namespace bs
