#include "time/disown.hpp"
#include <petsc/private/kspimpl.h>  // the operations of objects, which these are to refuse
#include <petsc/private/matimpl.h>
#include <petsc/private/pcimpl.h>
#include <petsc/private/snesimpl.h>
#include <petsc/private/tsimpl.h>

namespace bs {
namespace {

const char* const ENDED =
    "what this solver belongs to has ended, or has gone on from a state that was set or restored: ask the simulation for its solver again";

PetscErrorCode (*&teller())(const char* text) {
  static PetscErrorCode (*tell)(const char* text) = nullptr;
  return tell;
}

/// An operation of PETSc's, whatever its arguments.
template <class... Arguments>
PetscErrorCode refuse(Arguments...) {
  PetscFunctionBegin;
  if (teller()) PetscFunctionReturn(teller()(ENDED));
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_ORDER, "%s", ENDED);
}

template <class... Arguments>
void end(PetscErrorCode (*&operation)(Arguments...)) {
  if (operation) operation = refuse<Arguments...>;
}

/// Others than those of the program's own have nothing of a run.
void end_matrix(Mat A) {
  PetscBool shell = PETSC_FALSE;
  if (!A || PetscObjectTypeCompare(reinterpret_cast<PetscObject>(A), MATSHELL, &shell) || !shell) return;
  end(A->ops->mult);
  end(A->ops->multadd);
  end(A->ops->multtranspose);
  end(A->ops->multtransposeadd);
  end(A->ops->getdiagonal);
}

void end_preconditioner(PC pc) {
  end(pc->ops->setup);
  end(pc->ops->setuponblocks);
  end(pc->ops->presolve);
  end(pc->ops->apply);
  end(pc->ops->applytranspose);
  end(pc->ops->matapply);
  end(pc->ops->applyBA);
  end(pc->ops->applyrichardson);
}

PetscErrorCode end_solvers(SNES snes) {
  Mat A = nullptr, P = nullptr;
  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(snes, &A, &P, nullptr, nullptr));
  PetscCall(SNESSetFunction(snes, nullptr, refuse<SNES, Vec, Vec, void*>, nullptr));
  PetscCall(SNESSetJacobian(snes, nullptr, nullptr, refuse<SNES, Vec, Mat, Mat, void*>, nullptr));
  end(snes->ops->computeinitialguess);
  end(snes->ops->solve);
  end_matrix(A);
  end_matrix(P);
  if (!snes->ksp) PetscFunctionReturn(0);
  end(snes->ksp->ops->solve);
  if (snes->ksp->pc) end_preconditioner(snes->ksp->pc);
  PetscFunctionReturn(0);
}

}  // namespace

void tell_of_refusals(PetscErrorCode (*tell)(const char* text)) { teller() = tell; }

PetscErrorCode disown(TS ts) {
  Mat A = nullptr, P = nullptr;
  PetscErrorCode (*explicit_part)(TS, PetscReal, Vec, Vec, void*) = nullptr;
  PetscErrorCode (*implicit_part)(TS, PetscReal, Vec, Vec, Vec, void*) = nullptr;
  DM dm;
  PetscFunctionBegin;
  PetscCall(TSGetDM(ts, &dm));
  PetscCall(DMTSGetRHSFunction(dm, &explicit_part, nullptr));
  PetscCall(DMTSGetIFunction(dm, &implicit_part, nullptr));
  if (explicit_part) PetscCall(DMTSSetRHSFunction(dm, refuse<TS, PetscReal, Vec, Vec, void*>, nullptr));
  if (implicit_part) {
    PetscCall(TSGetIJacobian(ts, &A, &P, nullptr, nullptr));
    PetscCall(DMTSSetIFunction(dm, refuse<TS, PetscReal, Vec, Vec, Vec, void*>, nullptr));
    PetscCall(DMTSSetIJacobian(dm, refuse<TS, PetscReal, Vec, Vec, PetscReal, Mat, Mat, void*>, nullptr));
    end_matrix(A);
    end_matrix(P);
  }
  PetscCall(TSSetPreStep(ts, refuse<TS>));
  PetscCall(TSSetPostStep(ts, nullptr));
  PetscCall(TSSetPreStage(ts, nullptr));
  PetscCall(TSSetPostStage(ts, nullptr));
  end(ts->ops->step);
  if (ts->snes) PetscCall(end_solvers(ts->snes));
  PetscFunctionReturn(0);
}

}  // namespace bs
