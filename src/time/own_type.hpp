// What the program's own TS types share: the work vectors of their data, made at set-up and destroyed with it.
#pragma once
#include <petsc/private/tsimpl.h>  // of types of TS
#include <petscts.h>
#include "systems/model.hpp"
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

// The generalised-alpha method for M x'' = f(t, x, v) as a TS type (Chung and Hulbert 1993).

/// Registers `-ts_type alpha2`, in the place of PETSc's type of that name, with its options:
///   M ((1 - alpha_m) a_n + alpha_m a_{n+1}) = f(t_n + alpha_f h, x_f, v_f),   x_f = (1 - alpha_f) x_n + alpha_f x_{n+1}, v_f likewise,
///   x_{n+1} = x_n + h v_n + h^2 ((1/2 - beta) a_n + beta a_{n+1}),   v_{n+1} = v_n + h ((1 - gamma) a_n + gamma a_{n+1})
/// with alpha_m = (2 - rho)/(1 + rho), alpha_f = 1/(1 + rho), gamma = 1/2 + alpha_m - alpha_f, beta = (1 + alpha_m - alpha_f)^2/4 from
/// -ts_alpha_radius rho: order 2, and oscillations far above 1/h keep rho of their amplitude a step.
///
/// Newton's unknown is the state (x_{n+1}, v_{n+1}) as of the first-order types, so that tests of convergence, searches and
/// linear solvers are theirs. With sigma = gamma/(beta h) and mu = alpha_m/(alpha_f gamma h) its equations are F/alpha_f:
///   M (sigma (x_{n+1} - x_n) - v_{n+1} + (1 - gamma/beta) v_n + (1 - gamma/(2 beta)) h a_n) = 0
///   (M a_m - f)/alpha_f = 0                   J = [sigma M, -M; -K, mu M - D]
/// PETSc's own type takes accelerations as second differences of positions, which rounding makes useless at small steps, begins
/// with twice the initial one, and has no way in for a checkpoint. Here a_0 = M^-1 f(t_0, x_0, v_0).
PetscErrorCode register_alpha2();

/// Gives `ts`, of this type, the model that its forces come from.
PetscErrorCode alpha2_set_model(TS ts, Model& model);

struct AlphaParameters {
  PetscReal m = 0.5, f = 0.5, gamma = 0.5, beta = 0.25;
};

/// Of a TS of this type.
AlphaParameters alpha2_parameters(TS ts);

}  // namespace bs
