#include "base/factor_memory.hpp"
#include <petsc/private/pcimpl.h>  // nothing else tells whether a PC is set up
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
