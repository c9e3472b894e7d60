#include "base/factor_memory.hpp"
#include <petsc/private/pcimpl.h>  // nothing else tells whether a PC is set up
#include <algorithm>
#include <vector>
#include "base/collective.hpp"
#include "base/text.hpp"

namespace bs {
namespace {

bool of_type(PC pc, PCType type) {
  PetscBool same = PETSC_FALSE;
  (void)PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), type, &same);
  return same;
}

PetscErrorCode inner_solvers(PC pc, std::vector<KSP>* out) {
  PetscInt count = 0;
  KSP *inner = nullptr, whole = nullptr;
  PetscFunctionBegin;
  PetscErrorCode (*own)(PC, std::vector<KSP>*) = nullptr;
  PetscCall(PetscObjectQueryFunction(reinterpret_cast<PetscObject>(pc), "BSInnerSolvers_C", &own));
  if (own) PetscCall(own(pc, out));
  if (!pc->setupcalled) PetscFunctionReturn(0);
  if (of_type(pc, PCREDUNDANT)) PetscCall(PCRedundantGetKSP(pc, &whole));
  if (whole) out->push_back(whole);
  if (of_type(pc, PCBJACOBI)) PetscCall(PCBJacobiGetSubKSP(pc, &count, nullptr, &inner));
  if (of_type(pc, PCASM)) PetscCall(PCASMGetSubKSP(pc, &count, nullptr, &inner));
  const bool splits = of_type(pc, PCFIELDSPLIT);
  if (splits) PetscCall(PCFieldSplitGetSubKSP(pc, &count, &inner));
  out->insert(out->end(), inner, inner + count);
  if (splits) PetscCall(PetscFree(inner));
  PetscFunctionReturn(0);
}

PetscErrorCode inspect_factors(Mat factors, MemoryLack* out) {
  MatFactorError error;
  MatSolverType package = nullptr;
  const char* prefix = nullptr;
  PetscInt infog = 0;
  PetscFunctionBegin;
  PetscCall(MatFactorGetError(factors, &error));
  PetscCall(MatFactorGetSolverType(factors, &package));
  PetscCall(MatGetOptionsPrefix(factors, &prefix));
  out->prefix = prefix ? prefix : "";
  if (error == MAT_FACTOR_NOERROR) PetscFunctionReturn(0);
  if (package && std::string(package) == MATSOLVERMUMPS) PetscCall(MatMumpsGetInfog(factors, 1, &infog));
  if (mumps_lacks_memory(static_cast<long>(infog))) out->infog = infog;
  out->yes = error == MAT_FACTOR_OUTMEMORY || out->infog != 0;
  PetscFunctionReturn(0);
}

PetscErrorCode inspect(PC pc, MemoryLack* out) {
  PCFailedReason reason;
  std::vector<KSP> inner;
  PetscFunctionBegin;
  PetscCall(PCGetFailedReason(pc, &reason));
  if (reason != PC_NOERROR && (of_type(pc, PCLU) || of_type(pc, PCCHOLESKY))) {
    Mat factors = nullptr;
    PetscCall(PCFactorGetMatrix(pc, &factors));
    if (factors) PetscCall(inspect_factors(factors, out));
  }
  out->yes = out->yes || reason == PC_FACTOR_OUTMEMORY;
  PetscCall(inner_solvers(pc, &inner));
  for (std::size_t k = 0; k < inner.size() && !out->yes; ++k) {
    PC own;
    PetscCall(KSPGetPC(inner[k], &own));
    PetscCall(inspect(own, out));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode unite(MPI_Comm comm, MemoryLack* out) {
  int both[2] = {out->yes, static_cast<int>(-out->infog)};
  PetscFunctionBegin;
  PetscCall(max_over_ranks(comm, both, 2));
  out->yes = both[0] != 0;
  out->infog = -both[1];
  PetscFunctionReturn(0);
}

}  // namespace

std::string MemoryLack::why() const {
  return "no memory was left for the factors of the linear solver" +
         (infog == 0 ? std::string() : format(" (MUMPS: INFOG(1) = %lld)", static_cast<long long>(infog)));
}

std::string MemoryLack::remedy(const std::string& other) const {
  return mumps_memory_remedy(infog == 0 ? -13 : static_cast<long>(infog), prefix) + ", use more ranks, or " + other;
}

PetscErrorCode wider_work_space(Mat factors, PetscInt* percent) {
  constexpr PetscInt MOST = 2000;
  MatFactorError error;
  MemoryLack lack;
  PetscBool given = PETSC_FALSE;
  PetscFunctionBegin;
  *percent = 0;
  PetscCall(MatFactorGetError(factors, &error));
  if (error == MAT_FACTOR_NOERROR) PetscFunctionReturn(0);
  PetscCall(find_memory_lack(factors, &lack));
  if (lack.infog != -8 && lack.infog != -9) PetscFunctionReturn(0);
  PetscCall(PetscOptionsHasName(nullptr, lack.prefix.c_str(), "-mat_mumps_icntl_14", &given));
  PetscCall(MatMumpsGetIcntl(factors, MUMPS_WORK_SPACE, percent));
  *percent = given || *percent > MOST ? 0 : 3 * std::max<PetscInt>(*percent, 20);
  PetscFunctionReturn(0);
}

// PETSc does not call MUMPS again for factors that it could not make
PetscErrorCode set_up_solver(KSP ksp) {
  PC pc;
  Mat A, P, factors;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  for (;;) {
    PetscInt settings[] = {MUMPS_WORK_SPACE, 0, 13, 0, 24, 0};
    PetscCall(KSPSetUp(ksp));
    if (!of_type(pc, PCLU) && !of_type(pc, PCCHOLESKY)) break;
    PetscCall(PCFactorGetMatrix(pc, &factors));
    PetscCall(wider_work_space(factors, &settings[1]));
    if (settings[1] == 0) break;
    for (int k = 2; k < 6; k += 2) PetscCall(MatMumpsGetIcntl(factors, settings[k], &settings[k + 1]));
    PetscCall(KSPGetOperators(ksp, &A, &P));
    for (Mat m : {A, P}) PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(m)));
    const MatHandle own_A(A), own_P(P);
    PetscCall(PCReset(pc));
    PetscCall(KSPSetOperators(ksp, A, P));
    PetscCall(PCFactorSetUpMatSolverType(pc));
    PetscCall(PCFactorGetMatrix(pc, &factors));
    for (int k = 0; k < 6; k += 2) PetscCall(MatMumpsSetIcntl(factors, settings[k], settings[k + 1]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode find_memory_lack(MPI_Comm comm, PC pc, MemoryLack* out) {
  PetscFunctionBegin;
  *out = {};
  PetscCall(inspect(pc, out));
  PetscCall(unite(comm, out));
  PetscFunctionReturn(0);
}

PetscErrorCode find_memory_lack(Mat factors, MemoryLack* out) {
  PetscFunctionBegin;
  *out = {};
  if (!factors) PetscFunctionReturn(0);
  PetscCall(inspect_factors(factors, out));
  PetscCall(unite(PetscObjectComm(reinterpret_cast<PetscObject>(factors)), out));
  PetscFunctionReturn(0);
}

}  // namespace bs
