#include "time/ts_queries.hpp"
#include <string>
#include "solvers/condensed/condensed.hpp"

namespace bs {

PetscErrorCode is_adaptive(TS ts, bool* yes) {
  TSAdapt adapt;
  TSAdaptType type = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptGetType(adapt, &type));
  *yes = type && std::string(type) != TSADAPTNONE;
  PetscFunctionReturn(0);
}

PetscErrorCode linear_solver_of(TS ts, KSP* ksp, PC* pc) {
  SNES snes;
  KSP found;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetKSP(snes, &found));
  if (ksp) *ksp = found;
  if (pc) PetscCall(KSPGetPC(found, pc));
  PetscFunctionReturn(0);
}

PetscErrorCode linear_solver_lacks_memory(TS ts, bool* yes) {
  PC pc;
  PCFailedReason reason;
  bool inner = false;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(PCGetFailedReasonRank(pc, &reason));
  PetscCall(condensed_out_of_memory(pc, &inner));
  int lacks = inner || reason == PC_FACTOR_OUTMEMORY;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lacks, 1, MPI_INT, MPI_MAX, PetscObjectComm(reinterpret_cast<PetscObject>(ts))));
  *yes = lacks != 0;
  PetscFunctionReturn(0);
}

}  // namespace bs
