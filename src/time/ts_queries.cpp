#include "time/ts_queries.hpp"
#include <string>

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

}  // namespace bs
