#include "solve/convergence.hpp"
#include <algorithm>
#include <cmath>
#include <cstring>
#include "solve/condensed/condensed.hpp"
#include "solve/search/energy.hpp"
#include "solve/search/searches.hpp"
#include "solve/ts_queries.hpp"

namespace bs {
namespace {

/// Whether either part is below rtol of its first, or below `floors` times the rounding errors of the forces.
bool below(const NewtonPolicy& self, const ResidualNorms& now, double rtol, double floors) {
  // a momentum residual that starts at nothing (free flight) is judged by the velocity error it makes, to 1e-4 rtol
  const double kinematic = std::max(self.first[0], self.first[1] / self.sigma);
  const double momentum = std::max(self.first[1], 1e-4 * self.sigma * self.first[0]);
  return now[0] <= std::max(rtol * kinematic, floors * self.floor[0]) &&
         now[1] <= std::max(rtol * momentum, floors * self.floor[1]);
}

/// Near rounding level, and no longer falling: no further iterate is any better. The estimate of the rounding errors is a sum
/// of the worst cases, which Newton may well get below; so what the residual does decides.
bool exhausted(const NewtonPolicy& self, const ResidualNorms& now, double rtol) {
  constexpr double NEAR = 100, ROUNDING = 1e-13;
  const double size = ROUNDING * self.size_of_forces();
  const bool near = below(self, now, rtol, NEAR) || (self.sigma * now[0] <= size && now[1] <= size);
  const bool falling = now[0] < 0.5 * self.previous[0] || now[1] < 0.5 * self.previous[1];
  return near && !falling;
}

// Inexact Newton: a linear solve need not be better than Newton's own quadratic convergence lets it be, nor than what is
// left to do. eta = FIRST at first, then (|F_k|/|F_k-1|)^2 within [LEAST, FIRST], but at least SAFETY times the reduction
// that is still missing. Measured on blocks of 64,000 particles, plain and with 1 % of the springs 10^4 times stiffer, h omega
// 25 and 250: Krylov iterations fall by 7, 4, 2 and 22 % against FIRST = 1e-3, LEAST = 1e-8, for at most three Newton
// iterations more in five steps.
PetscErrorCode set_forcing(const NewtonPolicy& self, SNES snes, PetscInt it, const ResidualNorms& now, double rtol) {
  constexpr double FIRST = 1e-2, LEAST = 1e-3, SAFETY = 0.5;
  KSP ksp;
  PetscFunctionBegin;
  const double size = std::max(self.sigma * now[0], now[1]);
  const double goal = std::max(rtol * std::max(self.first[1], 1e-4 * self.sigma * self.first[0]), self.floor[1]);
  const double before = std::max(self.sigma * self.previous[0], self.previous[1]);
  const double quadratic = it == 0 || before <= 0 ? FIRST : (size / before) * (size / before);
  const double eta = std::max(std::clamp(quadratic, LEAST, FIRST), std::min(SAFETY * goal / size, 0.1));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPSetTolerances(ksp, eta, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

// A step of nothing is no sign of convergence where the linear solver has done nothing (-ksp_rtol 1): the step decides only
// where the residual, too, has fallen far.
bool step_decides(const NewtonPolicy& self, const ResidualNorms& now) {
  constexpr double FAR = 1e-4, NEAR = 100;
  return below(self, now, FAR, NEAR);
}

// The norms over everything may have converged for the sake of the heaviest or stiffest part alone: no particle may be left
// with forces that stand for a velocity error of more than PART of the largest speed, or a hundred rtol. One pass over two vectors, made only
// where the norms are content.
PetscErrorCode every_particle_has(const NewtonPolicy& self, SNES snes, Vec F, double rtol, bool* has) {
  constexpr double PART = 1e-6;
  double worst = 0, fastest = 0;
  Vec X;
  PetscFunctionBegin;
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(self.model->velocity_errors(X, F, self.sigma, self.form, &worst, &fastest));
  *has = worst <= std::max(PART, 100 * rtol) * fastest;
  PetscFunctionReturn(0);
}

// After a tangent that was not positive definite: is the next one worth being tried as it is? Near the minimum, where the
// residual falls from one iterate to the next, or now and then.
PetscErrorCode expect_definite(const NewtonPolicy& self, PetscInt it, const ResidualNorms& now) {
  constexpr double FALLEN = 0.3;
  constexpr PetscInt EVERY = 8;
  PC pc;
  PetscFunctionBegin;
  const double here = std::max(self.sigma * now[0], now[1]), before = std::max(self.sigma * self.previous[0], self.previous[1]);
  PetscCall(linear_solver_of(self.ts, nullptr, &pc));
  PetscCall(condensed_expect_definite(pc, it > 0 && (here < FALLEN * before || it % EVERY == EVERY - 1)));
  PetscFunctionReturn(0);
}

// Where many tangents were not positive definite, or many directions were taken from the definite part, the step spans many snaps
// from one shape to another, and shorter steps, whose tangents are definite, cost less than the way down from one to the next.
PetscErrorCode spans_too_much(NewtonPolicy* self, PetscInt it, bool* yes) {
  constexpr PetscInt DEFINITE = 8, INDEFINITE = 24;
  CondensedCounts counts;
  bool is = false;
  PC pc;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(self->ts, nullptr, &pc));
  PetscCall(condensed_counts(pc, &is, &counts));
  if (it == 0) {
    self->definite_before = counts.definite;
    self->indefinite_before = counts.indefinite;
  }
  *yes = counts.definite - self->definite_before >= DEFINITE || counts.indefinite - self->indefinite_before >= INDEFINITE;
  PetscFunctionReturn(0);
}

// Converged: every part has fallen by rtol, or to its rounding errors and falls no further, or all of F is below atol, or a
// whole Newton step below stol of the state. Diverged: not finite, or grown by the divergence tolerance.
PetscErrorCode test(SNES snes, PetscInt it, PetscReal xnorm, PetscReal snorm, PetscReal fnorm, SNESConvergedReason* reason,
                    void* context) {
  NewtonPolicy& self = *static_cast<NewtonPolicy*>(context);
  PetscReal atol, rtol, stol, divtol;
  Vec F;
  ResidualNorms now;
  PetscFunctionBegin;
  *reason = SNES_CONVERGED_ITERATING;
  if (PetscIsInfOrNanReal(fnorm)) {
    *reason = SNES_DIVERGED_FNORM_NAN;
    PetscFunctionReturn(0);
  }
  PetscCall(SNESGetTolerances(snes, &atol, &rtol, &stol, nullptr, nullptr));
  PetscCall(SNESGetDivergenceTolerance(snes, &divtol));
  PetscCall(SNESGetFunction(snes, &F, nullptr, nullptr));
  PetscCall(self.model->residual_norms(F, &now));
  if (it == 0) {
    PetscReal h;
    PetscCall(TSGetTimeStep(self.ts, &h));
    self.sigma = 1 / h;
    if (self.sigma != self.floor_sigma) PetscCall(self.estimate_floor(self.sigma));
    for (int k = 0; k < 2; ++k) self.first[k] = std::max(now[k], self.reference[k]);
    self.reference = {0, 0};
  }
  const double whole = std::hypot(self.first[0], self.first[1]);
  if (fnorm < atol) *reason = SNES_CONVERGED_FNORM_ABS;
  else if (it > 0 ? below(self, now, rtol, 0.0) : below(self, now, 0.0, 1.0)) *reason = SNES_CONVERGED_FNORM_RELATIVE;
  else if (it > 0 && exhausted(self, now, rtol)) *reason = SNES_CONVERGED_FNORM_RELATIVE;
  else if (it > 0 && snorm < stol * xnorm) *reason = step_decides(self, now) ? SNES_CONVERGED_SNORM_RELATIVE : SNES_DIVERGED_LINEAR_SOLVE;
  else if (it > 0 && divtol > 0 && whole > 0 && fnorm > divtol * whole) *reason = SNES_DIVERGED_DTOL;
  if (*reason == SNES_CONVERGED_FNORM_RELATIVE || *reason == SNES_CONVERGED_SNORM_RELATIVE) {
    bool has = true;
    PetscCall(every_particle_has(self, snes, F, rtol, &has));
    if (!has) *reason = SNES_CONVERGED_ITERATING;
    if (!has) ++self.uneven;
    else if (it > 0 && !below(self, now, rtol, 0.0)) ++self.at_floor;
  }
  if (*reason == SNES_CONVERGED_ITERATING && self.forcing) PetscCall(set_forcing(self, snes, it, now, rtol));
  if (*reason == SNES_CONVERGED_ITERATING && self.directions) {
    bool much = false;
    PetscCall(expect_definite(self, it, now));
    PetscCall(spans_too_much(&self, it, &much));
    if (much) *reason = SNES_DIVERGED_INNER;
  }
  self.previous = now;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode NewtonPolicy::estimate_floor(double of_sigma) {
  Vec y;
  PetscReal time;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTime(ts, &time));
  PetscCall(model->residual_floor(time, y, of_sigma, form, &floor));
  floor_sigma = of_sigma;
  PetscFunctionReturn(0);
}

PetscErrorCode NewtonPolicy::attach(TS stepper, SNES snes) {
  char type[64] = SNESNEWTONLS;
  PetscBool given = PETSC_FALSE;
  PetscFunctionBegin;
  ts = stepper;
  PetscCall(SNESSetConvergenceTest(snes, test, this, nullptr));
  PetscCall(set_search_policy(snes, this));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-snes_type", type, sizeof(type), nullptr));
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-snes_linesearch_type", &given));
  char search[64] = "energy";
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-snes_linesearch_type", search, sizeof search, nullptr));
  directions = std::strcmp(type, SNESNEWTONLS) == 0 && std::strcmp(search, "energy") == 0 && lacks_energy(*this).empty();
  if (given || std::strcmp(type, SNESNEWTONLS) != 0) PetscFunctionReturn(0);
  SNESLineSearch line;
  PetscCall(SNESGetLineSearch(snes, &line));
  PetscCall(SNESLineSearchSetType(line, "energy"));
  PetscFunctionReturn(0);
}

}  // namespace bs
