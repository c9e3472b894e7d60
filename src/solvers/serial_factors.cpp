#include "solvers/serial_factors.hpp"
#include <sstream>
#include <string>
#include "base/fault.hpp"

namespace bs {
namespace {

PetscErrorCode given(const std::string& name, bool* yes) {
  PetscBool found = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, name.c_str(), &found));
  *yes = found;
  PetscFunctionReturn(0);
}

PetscErrorCode set_unless_given(const std::string& name, const char* value) {
  bool there = false;
  PetscFunctionBegin;
  PetscCall(given(name, &there));
  if (!there) PetscCall(PetscOptionsSetValue(nullptr, name.c_str(), value));
  PetscFunctionReturn(0);
}

/// -P_pc_factor_X becomes -P_sub_pc_factor_X.
PetscErrorCode hand_down(const std::string& prefix) {
  char* all = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetAll(nullptr, &all));
  std::istringstream words(all);
  PetscCall(PetscFree(all));
  const std::string begin = "-" + prefix + "pc_factor_";
  for (std::string word; words >> word;) {
    if (word.compare(0, begin.size(), begin) != 0) continue;
    char value[256] = "";
    PetscCall(PetscOptionsGetString(nullptr, nullptr, word.c_str(), value, sizeof value, nullptr));  // it is used now
    PetscCall(set_unless_given("-" + prefix + "sub_" + word.substr(1 + prefix.size()), *value ? value : nullptr));
  }
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode split_serial_factors(MPI_Comm comm, const char* prefix) {
  PetscMPIInt size;
  char type[64] = "";
  bool package = false;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  const std::string own = prefix, option = "-" + own + "pc_type";
  PetscCall(PetscOptionsGetString(nullptr, nullptr, option.c_str(), type, sizeof type, nullptr));
  const std::string factor = type;
  if (size == 1 || (factor != "ilu" && factor != "icc")) PetscFunctionReturn(0);
  PetscCall(given("-" + own + "pc_factor_mat_solver_type", &package));
  if (package) PetscFunctionReturn(0);
  PetscCall(PetscOptionsSetValue(nullptr, option.c_str(), "bjacobi"));
  PetscCall(set_unless_given("-" + own + "sub_pc_type", type));
  PetscCall(hand_down(own));
  PetscCall(
      warn(comm, format("%s %s works on one rank: on %d ranks it is bjacobi with %s on the block of every rank", option.c_str(), type, size, type)));
  PetscFunctionReturn(0);
}

}  // namespace bs
