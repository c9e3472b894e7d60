// What the program's own TS types share: the work vectors of their data, made at set-up and destroyed with it.
#pragma once
#include <petsc/private/tsimpl.h>
#include "time/methods.hpp"

namespace bs {

/// Data of a TS type: derived from KeptAcceleration, with `vectors()`, a list of pointers to all of its Vecs.
template <class Data>
struct OwnType {
  static Data* of(TS ts) { return static_cast<Data*>(static_cast<KeptAcceleration*>(ts->data)); }

  static PetscErrorCode set_up(TS ts) {
    PetscFunctionBegin;
    for (Vec* vec : of(ts)->vectors()) PetscCall(VecDuplicate(ts->vec_sol, vec));
    PetscCall(TSGetAdapt(ts, &ts->adapt));
    PetscCall(TSAdaptCandidatesClear(ts->adapt));
    PetscFunctionReturn(0);
  }
  static PetscErrorCode reset(TS ts) {
    PetscFunctionBegin;
    for (Vec* vec : of(ts)->vectors()) PetscCall(VecDestroy(vec));
    of(ts)->known = false;
    PetscFunctionReturn(0);
  }
  static PetscErrorCode destroy(TS ts) {
    PetscFunctionBegin;
    PetscCall(reset(ts));
    delete of(ts);
    ts->data = nullptr;
    PetscFunctionReturn(0);
  }
  /// New data and the operations above; `step` advances by one step.
  static PetscErrorCode create(TS ts, PetscErrorCode (*step)(TS), bool uses_snes) {
    PetscFunctionBegin;
    ts->data = static_cast<KeptAcceleration*>(new Data);
    ts->ops->setup = set_up;
    ts->ops->step = step;
    ts->ops->reset = reset;
    ts->ops->destroy = destroy;
    ts->default_adapt_type = TSADAPTNONE;
    ts->usessnes = uses_snes ? PETSC_TRUE : PETSC_FALSE;
    PetscFunctionReturn(0);
  }
};

}  // namespace bs
