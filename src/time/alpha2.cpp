#include <array>
#include <utility>
#include "base/petsc_versions.hpp"
#include "base/vec_array.hpp"
#include "systems/layout.hpp"
#include "time/own_type.hpp"

namespace bs {
namespace {

struct Alpha2 : KeptAcceleration {
  AlphaParameters p;
  Model* model = nullptr;
  Vec next = nullptr;  ///< (., a_{n+1}); the one before survives a step that comes to nothing
  Vec start = nullptr, end = nullptr;
  Vec stage = nullptr, rate = nullptr;  ///< y_f; (x', v') that makes F the equations
  std::array<Vec*, 6> vectors() { return {&kept, &next, &start, &end, &stage, &rate}; }
};

Alpha2* data_of(TS ts) { return OwnType<Alpha2>::of(ts); }

AlphaParameters of_radius(PetscReal rho) {
  AlphaParameters p;
  p.m = (2 - rho) / (1 + rho);
  p.f = 1 / (1 + rho);
  p.gamma = 0.5 + p.m - p.f;
  p.beta = PetscSqr(1 + p.m - p.f) / 4;
  return p;
}

// a_{n+1} = (v_{n+1} - v_n)/(gamma h) + (1 - 1/gamma) a_n
PetscScalar new_acceleration(const AlphaParameters& p, PetscReal h, PetscScalar v0, PetscScalar v1, PetscScalar a0) {
  return (v1 - v0) / (p.gamma * h) + (1 - 1 / p.gamma) * a0;
}

// y_f and the rates x' = v_f + alpha_f r, v' = a_m, which make M (x' - v_f) = alpha_f M r and M v' - f the equations
PetscErrorCode set_stage(Alpha2& self, PetscReal h, Vec y) {
  PetscFunctionBegin;
  const AlphaParameters& p = self.p;
  const PetscReal sigma = p.gamma / (p.beta * h);
  const ReadArray start(self.start), kept(self.kept), end(y);
  const WriteArray stage(self.stage), rate(self.rate);
  layout_of(y).for_each([&](PetscInt x, PetscInt v) {
    const PetscScalar a0 = kept[v], v0 = start[v], dx = end[x] - start[x], dv = end[v] - v0;
    const PetscScalar r = sigma * dx - dv - p.gamma / p.beta * v0 + (1 - p.gamma / (2 * p.beta)) * h * a0;
    stage[x] = start[x] + p.f * dx;
    stage[v] = v0 + p.f * dv;
    rate[x] = stage[v] + p.f * r;
    rate[v] = a0 + p.m * (new_acceleration(p, h, v0, end[v], a0) - a0);
  });
  PetscFunctionReturn(0);
}

PetscErrorCode set_next(Alpha2& self, PetscReal h) {
  PetscFunctionBegin;
  const ReadArray start(self.start), kept(self.kept), end(self.end);
  const WriteArray next(self.next);
  layout_of(self.end).for_each([&](PetscInt x, PetscInt v) {
    next[x] = end[v];
    next[v] = new_acceleration(self.p, h, start[v], end[v], kept[v]);
  });
  PetscFunctionReturn(0);
}

PetscErrorCode form_function(SNES, Vec y, Vec F, TS ts) {
  Alpha2& self = *data_of(ts);
  PetscFunctionBegin;
  PetscCall(set_stage(self, ts->time_step, y));
  PetscCall(TSComputeIFunction(ts, ts->ptime + self.p.f * ts->time_step, self.stage, self.rate, F, PETSC_FALSE));
  PetscCall(VecScale(F, 1 / self.p.f));
  PetscFunctionReturn(0);
}

PetscErrorCode form_jacobian(SNES, Vec y, Mat A, Mat P, TS ts) {
  Alpha2& self = *data_of(ts);
  const PetscReal h = ts->time_step;
  PetscFunctionBegin;
  PetscCall(set_stage(self, h, y));
  PetscCall(TSComputeIJacobian(ts, ts->ptime + self.p.f * h, self.stage, self.rate, self.p.gamma / (self.p.beta * h), A, P, PETSC_FALSE));
  PetscFunctionReturn(0);
}

PetscErrorCode solve_step(TS ts, Alpha2& self, PetscBool* good) {
  const PetscReal stage_time = ts->ptime + self.p.f * ts->time_step;
  PetscInt newton, krylov;
  PetscFunctionBegin;
  PetscCall(TSPreStage(ts, stage_time));
  PetscCall(VecCopy(self.start, self.end));
  PetscCall(SNESSolve(ts->snes, nullptr, self.end));
  PetscCall(SNESGetIterationNumber(ts->snes, &newton));
  PetscCall(SNESGetLinearSolveIterations(ts->snes, &krylov));
  ts->snes_its += newton;
  ts->ksp_its += krylov;
  PetscCall(TSPostStage(ts, stage_time, 0, &self.end));
  PetscCall(TSAdaptCheckStage(ts->adapt, ts, stage_time, self.end, good));
  PetscFunctionReturn(0);
}

PetscErrorCode step_alpha2(TS ts) {
  Alpha2& self = *data_of(ts);
  PetscBool good = PETSC_FALSE;
  PetscInt rejections = 0;
  PetscFunctionBegin;
  PetscCheck(self.model, PetscObjectComm(reinterpret_cast<PetscObject>(ts)), PETSC_ERR_ORDER, "call alpha2_set_model() first");
  PetscCall(VecCopy(ts->vec_sol, self.start));
  if (!self.known) PetscCall(self.model->rhs(ts->ptime, ts->vec_sol, self.kept));
  self.known = true;
  while (!ts->reason) {
    const PetscReal h = ts->time_step;
    PetscReal next = h;
    PetscCall(solve_step(ts, self, &good));
    if (good) {
      PetscCall(set_next(self, h));
      PetscCall(VecCopy(self.end, ts->vec_sol));
      PetscCall(TSAdaptChoose(ts->adapt, ts, h, nullptr, &next, &good));
      ts->time_step = next;
    }
    if (good) {
      std::swap(self.kept, self.next);
      ts->ptime += h;
      break;
    }
    PetscCall(VecCopy(self.start, ts->vec_sol));
    ++ts->reject;
    if (!ts->reason && ++rejections > ts->max_reject && ts->max_reject >= 0) ts->reason = TS_DIVERGED_STEP_REJECTED;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode set_up_alpha2(TS ts) {
  Alpha2* self = data_of(ts);
  PetscFunctionBegin;
  PetscCall(OwnType<Alpha2>::set_up(ts));
  PetscCall(TSGetSNES(ts, &ts->snes));
  // mu/sigma
  if (self->model) self->model->set_inertia(self->p.m * self->p.beta / (self->p.f * PetscSqr(self->p.gamma)));
  PetscFunctionReturn(0);
}

PetscErrorCode options_of_alpha2(TS ts, OptionItems PetscOptionsObject) {
  AlphaParameters& p = data_of(ts)->p;
  PetscReal radius = 1;
  PetscBool given = PETSC_FALSE;
  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "Generalised-alpha method for second-order systems");
  PetscCall(PetscOptionsReal("-ts_alpha_radius", "Spectral radius at infinite frequency, 0 to 1", "TSAlpha2SetRadius", radius, &radius, &given));
  if (given) p = of_radius(radius);
  PetscCall(
      PetscOptionsReal("-ts_alpha_alpha_m", "Fraction of a step at which accelerations are evaluated", "TSAlpha2SetParams", p.m, &p.m, nullptr));
  PetscCall(PetscOptionsReal("-ts_alpha_alpha_f", "Fraction of a step at which forces are evaluated", "TSAlpha2SetParams", p.f, &p.f, nullptr));
  PetscCall(PetscOptionsReal("-ts_alpha_gamma", "gamma of Newmark's velocities", "TSAlpha2SetParams", p.gamma, &p.gamma, nullptr));
  PetscCall(PetscOptionsReal("-ts_alpha_beta", "beta of Newmark's positions", "TSAlpha2SetParams", p.beta, &p.beta, nullptr));
  PetscOptionsHeadEnd();
  PetscFunctionReturn(0);
}

PetscErrorCode create_alpha2(TS ts) {
  PetscFunctionBegin;
  PetscCall(OwnType<Alpha2>::create(ts, step_alpha2, true));
  ts->ops->setup = set_up_alpha2;
  ts->ops->setfromoptions = options_of_alpha2;
  ts->ops->snesfunction = form_function;
  ts->ops->snesjacobian = form_jacobian;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode register_alpha2() { return TSRegister("alpha2", create_alpha2); }

PetscErrorCode alpha2_set_model(TS ts, Model& model) {
  PetscFunctionBegin;
  data_of(ts)->model = &model;
  PetscFunctionReturn(0);
}

AlphaParameters alpha2_parameters(TS ts) { return data_of(ts)->p; }

}  // namespace bs
