#include <array>
#include <utility>
#include "base/vec_array.hpp"
#include "systems/layout.hpp"
#include "time/methods.hpp"
#include "time/own_type.hpp"

namespace bs {

namespace {

struct Verlet : KeptAcceleration {
  Vec next = nullptr;   ///< (., a_{n+1}); separate from `kept`, so that a_n survives a step that fails
  Vec trial = nullptr;  ///< the state at which a_{n+1} is evaluated
  std::array<Vec*, 3> vectors() { return {&kept, &next, &trial}; }
};

// Writes v_h = v_n + h/2 a_n and x_{n+1} = x_n + h v_h to y, x_{n+1} and v_h + h/2 a_n to trial
PetscErrorCode kick_and_drift(Vec y, Vec kept, PetscReal h, Vec trial) {
  PetscFunctionBegin;
  const WriteArray ay(y), at(trial);
  const ReadArray a(kept);
  layout_of(y).for_each([&](PetscInt x, PetscInt v) {
    ay[v] += h / 2 * a[v];
    ay[x] += h * ay[v];
    at[x] = ay[x];
    at[v] = ay[v] + h / 2 * a[v];
  });
  PetscFunctionReturn(0);
}

// v_{n+1} = v_h + h/2 a_{n+1}
PetscErrorCode kick(Vec y, Vec kept, PetscReal h) {
  PetscFunctionBegin;
  const WriteArray ay(y);
  const ReadArray a(kept);
  layout_of(y).for_each([&](PetscInt, PetscInt v) { ay[v] += h / 2 * a[v]; });
  PetscFunctionReturn(0);
}

PetscErrorCode step_verlet(TS ts) {
  Verlet* self = OwnType<Verlet>::of(ts);
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
  PetscFunctionBegin;
  PetscCall(TSCheckImplicitTerm(ts));
  PetscCall(OwnType<Verlet>::set_up(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode create_verlet(TS ts) {
  PetscFunctionBegin;
  PetscCall(OwnType<Verlet>::create(ts, step_verlet, false));
  ts->ops->setup = set_up_verlet;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode register_verlet() { return TSRegister("verlet", create_verlet); }

PetscErrorCode kept_acceleration(TS ts, KeptAcceleration** out) {
  PetscFunctionBegin;
  *out = static_cast<KeptAcceleration*>(ts->data);
  PetscFunctionReturn(0);
}

namespace {

struct Symplectic : KeptAcceleration {  // its `kept` is not used
  Vec update = nullptr;
  std::array<Vec*, 1> vectors() { return {&update}; }
};

// v_{n+1} = v_n + h M^-1 f(t_n, x_n, v_n),  x_{n+1} = x_n + h v_{n+1}
PetscErrorCode advance(Vec y, Vec G, PetscReal h) {
  PetscFunctionBegin;
  const WriteArray ay(y);
  const ReadArray aG(G);
  layout_of(y).for_each([&](PetscInt x, PetscInt v) {
    ay[v] += h * aG[v];
    ay[x] += h * ay[v];
  });
  PetscFunctionReturn(0);
}

PetscErrorCode step_symplectic(TS ts) {
  Symplectic* self = OwnType<Symplectic>::of(ts);
  PetscBool accept = PETSC_TRUE;
  PetscReal next = ts->time_step;
  PetscFunctionBegin;
  PetscCall(TSPreStage(ts, ts->ptime));
  PetscCall(TSComputeRHSFunction(ts, ts->ptime, ts->vec_sol, self->update));
  PetscCall(advance(ts->vec_sol, self->update, ts->time_step));
  PetscCall(TSPostStage(ts, ts->ptime, 0, &ts->vec_sol));
  PetscCall(TSAdaptChoose(ts->adapt, ts, ts->time_step, nullptr, &next, &accept));
  ts->ptime += ts->time_step;
  ts->time_step = next;
  PetscFunctionReturn(0);
}

PetscErrorCode set_up_symplectic(TS ts) {
  PetscInt bs = 1;
  PetscFunctionBegin;
  PetscCall(TSCheckImplicitTerm(ts));
  PetscCall(VecGetBlockSize(ts->vec_sol, &bs));
  PetscCheck(bs % 2 == 0, PetscObjectComm(reinterpret_cast<PetscObject>(ts)), PETSC_ERR_ARG_INCOMP,
             "-ts_type symplectic needs a state of positions and velocities");
  PetscCall(OwnType<Symplectic>::set_up(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode create_symplectic(TS ts) {
  PetscFunctionBegin;
  PetscCall(OwnType<Symplectic>::create(ts, step_symplectic, false));
  ts->ops->setup = set_up_symplectic;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode register_symplectic() { return TSRegister("symplectic", create_symplectic); }

}  // namespace bs
