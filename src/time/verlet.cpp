#include "time/verlet.hpp"
#include <petsc/private/tsimpl.h>
#include <utility>
#include "systems/layout.hpp"
#include "time/kept_acceleration.hpp"

namespace bs {
namespace {

struct Verlet : KeptAcceleration {
  Vec next = nullptr;   ///< (., a_{n+1}); the one before survives a step that comes to nothing
  Vec trial = nullptr;  ///< what a_{n+1} is taken at
};

Verlet* data_of(TS ts) { return static_cast<Verlet*>(static_cast<KeptAcceleration*>(ts->data)); }

// v_h = v_n + h/2 a_n and x_{n+1} = x_n + h v_h into y, x_{n+1} and v_h + h/2 a_n into trial
PetscErrorCode kick_and_drift(Vec y, Vec kept, PetscReal h, Vec trial) {
  PetscScalar *ay = nullptr, *at = nullptr;
  const PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArray(y, &ay));
  PetscCall(VecGetArrayWrite(trial, &at));
  PetscCall(VecGetArrayRead(kept, &a));
  layout_of(y).for_each([&](PetscInt x, PetscInt v) {
    ay[v] += h / 2 * a[v];
    ay[x] += h * ay[v];
    at[x] = ay[x];
    at[v] = ay[v] + h / 2 * a[v];
  });
  PetscCall(VecRestoreArrayRead(kept, &a));
  PetscCall(VecRestoreArrayWrite(trial, &at));
  PetscCall(VecRestoreArray(y, &ay));
  PetscFunctionReturn(0);
}

// v_{n+1} = v_h + h/2 a_{n+1}
PetscErrorCode kick(Vec y, Vec kept, PetscReal h) {
  PetscScalar* ay = nullptr;
  const PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArray(y, &ay));
  PetscCall(VecGetArrayRead(kept, &a));
  layout_of(y).for_each([&](PetscInt, PetscInt v) { ay[v] += h / 2 * a[v]; });
  PetscCall(VecRestoreArrayRead(kept, &a));
  PetscCall(VecRestoreArray(y, &ay));
  PetscFunctionReturn(0);
}

PetscErrorCode step_verlet(TS ts) {
  Verlet* self = data_of(ts);
  PetscBool accept = PETSC_TRUE;
  const PetscReal h = ts->time_step;
  PetscReal next = h;
  PetscFunctionBegin;
  if (!self->known) PetscCall(TSComputeRHSFunction(ts, ts->ptime, ts->vec_sol, self->kept));
  self->known = true;
  PetscCall(TSPreStage(ts, ts->ptime + h));
  PetscCall(kick_and_drift(ts->vec_sol, self->kept, h, self->trial));
  PetscCall(TSComputeRHSFunction(ts, ts->ptime + h, self->trial, self->next));
  PetscCall(kick(ts->vec_sol, self->next, h));
  std::swap(self->kept, self->next);
  PetscCall(TSPostStage(ts, ts->ptime + h, 0, &ts->vec_sol));
  PetscCall(TSAdaptChoose(ts->adapt, ts, h, nullptr, &next, &accept));
  ts->ptime += h;
  ts->time_step = next;
  PetscFunctionReturn(0);
}

PetscErrorCode set_up_verlet(TS ts) {
  Verlet* self = data_of(ts);
  PetscFunctionBegin;
  PetscCall(TSCheckImplicitTerm(ts));
  PetscCall(VecDuplicate(ts->vec_sol, &self->kept));
  PetscCall(VecDuplicate(ts->vec_sol, &self->next));
  PetscCall(VecDuplicate(ts->vec_sol, &self->trial));
  PetscCall(TSGetAdapt(ts, &ts->adapt));
  PetscCall(TSAdaptCandidatesClear(ts->adapt));
  PetscFunctionReturn(0);
}

PetscErrorCode reset_verlet(TS ts) {
  Verlet* self = data_of(ts);
  PetscFunctionBegin;
  PetscCall(VecDestroy(&self->kept));
  PetscCall(VecDestroy(&self->next));
  PetscCall(VecDestroy(&self->trial));
  self->known = false;
  PetscFunctionReturn(0);
}

PetscErrorCode destroy_verlet(TS ts) {
  PetscFunctionBegin;
  PetscCall(reset_verlet(ts));
  delete data_of(ts);
  ts->data = nullptr;
  PetscFunctionReturn(0);
}

PetscErrorCode create_verlet(TS ts) {
  PetscFunctionBegin;
  ts->data = static_cast<KeptAcceleration*>(new Verlet);
  ts->ops->setup = set_up_verlet;
  ts->ops->step = step_verlet;
  ts->ops->reset = reset_verlet;
  ts->ops->destroy = destroy_verlet;
  ts->default_adapt_type = TSADAPTNONE;
  ts->usessnes = PETSC_FALSE;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode register_verlet() {
  PetscFunctionBegin;
  PetscCall(TSRegister("verlet", create_verlet));
  PetscFunctionReturn(0);
}

PetscErrorCode kept_acceleration(TS ts, KeptAcceleration** out) {
  PetscFunctionBegin;
  *out = static_cast<KeptAcceleration*>(ts->data);
  PetscFunctionReturn(0);
}

}  // namespace bs
