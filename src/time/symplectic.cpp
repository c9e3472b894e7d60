#include <array>
#include "systems/layout.hpp"
#include "time/methods.hpp"
#include "time/own_type.hpp"

namespace bs {
namespace {

struct Symplectic : KeptAcceleration {  // of which it keeps none
  Vec update = nullptr;
  std::array<Vec*, 1> vectors() { return {&update}; }
};

// v_{n+1} = v_n + h M^-1 f(t_n, x_n, v_n),  x_{n+1} = x_n + h v_{n+1}
PetscErrorCode advance(Vec y, Vec G, PetscReal h) {
  PetscScalar* ay = nullptr;
  const PetscScalar* aG = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArray(y, &ay));
  PetscCall(VecGetArrayRead(G, &aG));
  layout_of(y).for_each([&](PetscInt x, PetscInt v) {
    ay[v] += h * aG[v];
    ay[x] += h * ay[v];
  });
  PetscCall(VecRestoreArrayRead(G, &aG));
  PetscCall(VecRestoreArray(y, &ay));
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

PetscErrorCode register_symplectic() {
  PetscFunctionBegin;
  PetscCall(TSRegister("symplectic", create_symplectic));
  PetscFunctionReturn(0);
}

}  // namespace bs
