#include "solvers/solver_check.hpp"
#include <string>
#include "base/fault.hpp"

namespace bs {
namespace {

PetscErrorCode is_on(const char* name, bool* yes) {
  PetscBool value = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, name, &value, nullptr));
  *yes = value;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode refuse_impossible_solvers(MPI_Comm comm) {
  char type[64] = "";
  PetscBool matrix = PETSC_FALSE;
  bool free = false, free_operator = false;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-snes_type", type, sizeof type, nullptr));
  const std::string snes = type;
  for (const char* name : {"patch", "shell", "python", "multiblock", "nasm", "aspin"})
    if (snes == name)
      PetscCall(tell(comm, Exit::input, "option -snes_type: " + snes + " needs a mesh or user code: give newtonls, newtontr, qn, ngmres, ..."));
  if (snes == "ms")
    PetscCall(
        tell(comm, Exit::input, "option -snes_type: ms is a smoother that does not test for convergence: give newtonls, newtontr, qn, ngmres, ..."));
  PetscBool scaled = PETSC_FALSE;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-ksp_diagonal_scale", &scaled));
  if (scaled)
    PetscCall(tell(comm, Exit::input,
                   "option -ksp_diagonal_scale: the condensed solve does not scale its system: leave the option out, or give it as "
                   "-condensed_ksp_diagonal_scale"));
  char factors[64] = "", pc[64] = "";
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-pc_factor_mat_solver_type", factors, sizeof factors, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-pc_type", pc, sizeof pc, nullptr));
  if (std::string(pc) == "ilu" && std::string(factors) == "superlu")
    PetscCall(
        tell(comm, Exit::input,
             "options -pc_type ilu and -pc_factor_mat_solver_type superlu: the library aborts on them: give -pc_type lu, or leave the second out"));
  // the option would make another type of the matrix-free operator, too, which then has no entries
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-mat_type", &matrix));
  PetscCall(is_on("-snes_mf", &free));
  PetscCall(is_on("-snes_mf_operator", &free_operator));
  if (matrix && (free || free_operator))
    PetscCall(tell(comm, Exit::input,
                   std::string("options -mat_type and ") + (free ? "-snes_mf" : "-snes_mf_operator") + " cannot be combined: leave one of them out"));
  PetscFunctionReturn(0);
}

}  // namespace bs
