#include <algorithm>
#include <cmath>
#include <string>
#include <vector>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/factor_memory.hpp"
#include "base/handle.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "systems/linear/system.hpp"

namespace bs {

PetscErrorCode create_direct(MPI_Comm comm, Mat A, const char* prefix, KSP* ksp) {
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPCreate(comm, ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, prefix));
  PetscCall(KSPSetOperators(*ksp, A, A));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPSetTolerances(*ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));  // of what options put in its place
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscCall(set_up_solver(*ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode trial_residual(KSP ksp, double* left) {
  PC pc;
  Mat A;
  PetscBool direct = PETSC_FALSE, alone = PETSC_FALSE;
  PetscInt first, last;
  PetscReal size;
  PetscFunctionBegin;
  *left = 0;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &direct, PCLU, PCCHOLESKY, ""));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ksp), KSPPREONLY, &alone));
  if (direct || !alone) PetscFunctionReturn(0);
  VecHandle b, x;
  PetscScalar* ab;
  PetscCall(KSPGetOperators(ksp, &A, nullptr));
  PetscCall(MatCreateVecs(A, x.out(), b.out()));
  PetscCall(VecGetOwnershipRange(b, &first, &last));
  PetscCall(VecGetArrayWrite(b, &ab));
  for (PetscInt i = first; i < last; ++i) ab[i - first] = 1 + 0.3 * std::sin(static_cast<double>(i));
  PetscCall(VecRestoreArrayWrite(b, &ab));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(VecNorm(b, NORM_2, &size));
  VecHandle r;
  PetscCall(VecDuplicate(b, r.out()));
  PetscCall(MatMult(A, x, r));
  PetscCall(VecAXPY(r, -1, b));
  PetscCall(VecNorm(r, NORM_2, left));
  *left = std::isfinite(*left) ? *left / size : 1e300;
  PetscFunctionReturn(0);
}

PetscErrorCode refusal_of(KSP ksp, const char* prefix, std::string* text) {
  constexpr double MOST = 1e-6;
  double left = 0;
  PC pc;
  PCType type = nullptr;
  PetscFunctionBegin;
  text->clear();
  PetscCall(trial_residual(ksp, &left));
  if (left <= MOST) PetscFunctionReturn(0);
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetType(pc, &type));
  *text = format(
      "options -%sksp_type preonly and -%spc_type %s: they do not solve the linear system, a trial left a residual of %.2g of its right side: "
      "give -%sksp_type gmres, or -%spc_type lu",
      prefix, prefix, type ? type : "", left, prefix, prefix);
  PetscFunctionReturn(0);
}

PetscErrorCode is_singular(KSP ksp, bool* singular) {
  PC pc;
  Mat A;
  PCFailedReason reason;
  PetscBool direct = PETSC_FALSE, alone = PETSC_FALSE;
  PetscInt n, first, last;
  PetscFunctionBegin;
  *singular = false;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &direct, PCLU, PCCHOLESKY, ""));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ksp), KSPPREONLY, &alone));
  if (!direct || !alone) PetscFunctionReturn(0);
  PetscCall(PCGetFailedReason(pc, &reason));
  bool failed = false;
  PetscCall(on_some_rank(PetscObjectComm(reinterpret_cast<PetscObject>(ksp)), reason != PC_NOERROR, &failed));
  MemoryLack lack;
  PetscCall(find_memory_lack(PetscObjectComm(reinterpret_cast<PetscObject>(ksp)), pc, &lack));
  if (lack.yes)
    PetscCall(fail(PetscObjectComm(reinterpret_cast<PetscObject>(ksp)), Exit::input,
                   lack.said("an iterative solver such as -ksp_type gmres -pc_type bjacobi")));
  *singular = failed != 0;
  if (*singular) PetscFunctionReturn(0);
  // x_j = 1/|column j|: each contributes alike to b = A x
  PetscCall(KSPGetOperators(ksp, nullptr, &A));
  PetscCall(MatGetSize(A, nullptr, &n));
  std::vector<PetscReal> size(static_cast<std::size_t>(n));
  PetscCall(MatGetColumnNorms(A, NORM_INFINITY, size.data()));
  VecHandle x, b, y;
  PetscScalar* ax;
  PetscCall(MatCreateVecs(A, x.out(), b.out()));
  PetscCall(VecDuplicate(x, y.out()));
  PetscCall(VecGetOwnershipRange(x, &first, &last));
  PetscCall(VecGetArrayWrite(x, &ax));
  for (PetscInt j = first; j < last; ++j) ax[j - first] = size[j] > 0 ? (1 + 0.3 * std::sin(static_cast<double>(j))) / size[j] : 1.0;
  PetscCall(VecRestoreArrayWrite(x, &ax));
  PetscCall(MatMult(A, x, b));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(VecAXPY(y, -1, x));
  const ReadArray ay(y);
  double worst = 0;
  for (PetscInt j = first; j < last; ++j) {
    const double off = std::abs(ay[j - first]) * size[j];
    worst = std::isfinite(off) ? std::max(worst, off) : 1e300;
  }
  PetscCall(max_over_ranks(PetscObjectComm(reinterpret_cast<PetscObject>(ksp)), &worst));
  *singular = worst > 0.05;
  PetscFunctionReturn(0);
}

}  // namespace bs
