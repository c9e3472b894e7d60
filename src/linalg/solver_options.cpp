#include "linalg/solver_options.hpp"
#include <petscksp.h>
#include <limits>
#include <sstream>
#include <string>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"

namespace bs {

PetscErrorCode has_blocks(PC pc, bool* yes) {
  PetscBool found = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &found, PCBJACOBI, PCASM, ""));
  *yes = found;
  PetscFunctionReturn(0);
}

PetscErrorCode factoring_pc(PC pc, PC* out) {
  PetscBool redundant = PETSC_FALSE;
  KSP own = nullptr;
  PetscFunctionBegin;
  *out = pc;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCREDUNDANT, &redundant));
  if (!redundant) PetscFunctionReturn(0);
  PetscCall(PCRedundantGetKSP(pc, &own));
  PetscCall(KSPGetPC(own, out));
  PetscFunctionReturn(0);
}

PetscErrorCode count_mumps_pivots(Mat factors) {
  PetscFunctionBegin;
  PetscCall(MatMumpsSetIcntl(factors, 24, 1));
  PetscCall(MatMumpsSetIcntl(factors, 13, 1));
  PetscFunctionReturn(0);
}

PetscErrorCode count_mumps_pivots(PC pc) {
  Mat factors = nullptr;
  PetscFunctionBegin;
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &factors));
  PetscCall(count_mumps_pivots(factors));
  PetscFunctionReturn(0);
}

PetscErrorCode make_pivots_relative(PC pc, bool set_up) {
  PetscBool factors = PETSC_FALSE, given = PETSC_FALSE, jacobi = PETSC_FALSE;
  const char* prefix = nullptr;
  bool blocks = false;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &factors, PCLU, PCILU, PCCHOLESKY, ""));
  if (factors) {
    MatFactorShiftType shift;
    PetscCall(PCGetOptionsPrefix(pc, &prefix));
    PetscCall(PetscOptionsHasName(nullptr, prefix, "-pc_factor_zeropivot", &given));
    PetscCall(PCFactorGetShiftType(pc, &shift));
    // the other shifts compare a pivot with its row
    const bool absolute = shift == MAT_SHIFT_NONE || shift == MAT_SHIFT_INBLOCKS;
    if (!given && absolute) PetscCall(PCFactorSetZeroPivot(pc, std::numeric_limits<PetscReal>::min()));
  }
  PetscCall(has_blocks(pc, &blocks));
  if (!blocks || !set_up) PetscFunctionReturn(0);
  PetscInt count = 0;
  KSP* inner = nullptr;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCBJACOBI, &jacobi));
  if (jacobi) PetscCall(PCBJacobiGetSubKSP(pc, &count, nullptr, &inner));
  else PetscCall(PCASMGetSubKSP(pc, &count, nullptr, &inner));
  for (PetscInt k = 0; k < count; ++k) {
    PC own;
    PetscCall(KSPGetPC(inner[k], &own));
    PetscCall(make_pivots_relative(own, false));
  }
  PetscFunctionReturn(0);
}

namespace {

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
  char type[64] = "";
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  const std::string own = prefix, option = "-" + own + "pc_type";
  PetscCall(PetscOptionsGetString(nullptr, nullptr, option.c_str(), type, sizeof type, nullptr));
  const std::string factor = type;
  if (size == 1 || (factor != "ilu" && factor != "icc")) PetscFunctionReturn(0);
  if (is_given("-" + own + "pc_factor_mat_solver_type")) PetscFunctionReturn(0);
  PetscCall(PetscOptionsSetValue(nullptr, option.c_str(), "bjacobi"));
  PetscCall(set_unless_given("-" + own + "sub_pc_type", type));
  PetscCall(hand_down(own));
  PetscCall(warn(comm, "block_jacobi",
                 format("%s %s works on one rank: on %d ranks it is bjacobi with %s on the block of every rank", option.c_str(), type, size, type)));
  PetscFunctionReturn(0);
}

PetscErrorCode refuse_impossible_solvers(MPI_Comm comm) {
  char type[64] = "";
  bool free = false, free_operator = false;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-snes_type", type, sizeof type, nullptr));
  const std::string snes = type;
  for (const char* name : {"patch", "shell", "python", "multiblock", "nasm", "aspin"})
    if (snes == name)
      PetscCall(fail(comm, Exit::input, "option -snes_type: " + snes + " needs a mesh or user code: give newtonls, newtontr, qn, ngmres, ..."));
  if (snes == "ms")
    PetscCall(
        fail(comm, Exit::input, "option -snes_type: ms is a smoother that does not test for convergence: give newtonls, newtontr, qn, ngmres, ..."));
  bool scaled = false;
  PetscCall(is_on("-ksp_diagonal_scale", &scaled));
  if (scaled)
    PetscCall(fail(comm, Exit::input,
                   "option -ksp_diagonal_scale: the condensed solve does not scale its system: leave the option out, or give it as "
                   "-condensed_ksp_diagonal_scale"));
  char factors[64] = "", pc[64] = "";
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-pc_factor_mat_solver_type", factors, sizeof factors, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-pc_type", pc, sizeof pc, nullptr));
  if (std::string(pc) == "ilu" && std::string(factors) == "superlu")
    PetscCall(
        fail(comm, Exit::input,
             "options -pc_type ilu and -pc_factor_mat_solver_type superlu: the library aborts on them: give -pc_type lu, or leave the second out"));
  // the option would make another type of the matrix-free operator, too, which then has no entries
  PetscCall(is_on("-snes_mf", &free));
  PetscCall(is_on("-snes_mf_operator", &free_operator));
  if (is_given("-mat_type") && (free || free_operator))
    PetscCall(fail(comm, Exit::input,
                   std::string("options -mat_type and ") + (free ? "-snes_mf" : "-snes_mf_operator") + " cannot be combined: leave one of them out"));
  PetscFunctionReturn(0);
}

}  // namespace bs
