#include "solve/convergence.hpp"
#include <algorithm>
#include <cmath>
#include <cstring>

namespace bs {
namespace {

// A kinematic residual r is worth the force sigma r: the velocity it stands for, brought up within a step.
double size_of_forces(const NewtonPolicy& self) { return std::max(self.sigma * self.first[0], self.first[1]); }

bool below(const NewtonPolicy& self, const ResidualNorms& now, double rtol, double floors) {
  // a momentum residual that starts at nothing (free flight) is judged by the velocity error it makes, to 1e-4 rtol
  const double kinematic = std::max(self.first[0], self.first[1] / self.sigma);
  const double momentum = std::max(self.first[1], 1e-4 * self.sigma * self.first[0]);
  return now[0] <= std::max(rtol * kinematic, floors * self.floor[0]) &&
         now[1] <= std::max(rtol * momentum, floors * self.floor[1]);
}

/// Near rounding level, and no longer falling: no further iterate is any better.
bool exhausted(const NewtonPolicy& self, const ResidualNorms& now, double rtol) {
  constexpr double NEAR = 100, ROUNDING = 1e-13;
  const double size = ROUNDING * size_of_forces(self);
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

// Converged: every part has fallen by rtol or to its rounding errors, or all of F is below atol, or a whole Newton step
// below stol of the state. Diverged: not finite, or grown by the divergence tolerance.
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
    for (int k = 0; k < 2; ++k) self.first[k] = std::max(now[k], self.reference[k]);
    self.reference = {0, 0};
  }
  const double whole = std::hypot(self.first[0], self.first[1]);
  if (fnorm < atol) *reason = SNES_CONVERGED_FNORM_ABS;
  else if (below(self, now, it > 0 ? rtol : 0.0, 1.0) || (it > 1 && exhausted(self, now, rtol))) *reason = SNES_CONVERGED_FNORM_RELATIVE;
  else if (it > 0 && snorm < stol * xnorm) *reason = SNES_CONVERGED_SNORM_RELATIVE;
  else if (it > 0 && divtol > 0 && whole > 0 && fnorm > divtol * whole) *reason = SNES_DIVERGED_DTOL;
  if (*reason == SNES_CONVERGED_ITERATING && self.forcing) PetscCall(set_forcing(self, snes, it, now, rtol));
  self.previous = now;
  PetscFunctionReturn(0);
}

// phi = |(sigma F_x, F_v)| / max(sigma |F_x|, |F_v|) of the first iterate, where a part below its rounding errors counts as 0
double merit(const NewtonPolicy& self, const ResidualNorms& now) {
  const double kinematic = now[0] > self.floor[0] ? self.sigma * now[0] : 0;
  const double momentum = now[1] > self.floor[1] ? now[1] : 0;
  const double size = size_of_forces(self);
  return std::hypot(kinematic, momentum) / (size > 0 ? size : 1);
}

// The first iterations take full steps, also uphill: through stiff springs a good step first raises the residual by
// orders of magnitude, and searching for descent there costs ten times the iterations. What has not converged by then
// (full Newton can cycle) goes on by backtracking on phi: phi(lambda) <= (1 - 1e-4 lambda) phi(0), the next lambda from the parabola through phi(0)^2,
// its Newton slope -2 phi(0)^2 and phi(lambda)^2, within [0.1, 0.5] lambda.
PetscErrorCode search(SNESLineSearch line, void* context) {
  constexpr int TRIES = 30, BOLD = 10;
  constexpr double UPHILL = 1e4;
  constexpr double NOISE = 1e-12;
  NewtonPolicy& self = *static_cast<NewtonPolicy*>(context);
  SNES snes;
  Vec X, F, Y, W, G;
  PetscBool changed = PETSC_FALSE;
  PetscReal fnorm = 0, xnorm, ynorm, lambda = 1;
  ResidualNorms now;
  PetscFunctionBegin;
  PetscCall(SNESLineSearchGetSNES(line, &snes));
  PetscCall(SNESLineSearchGetVecs(line, &X, &F, &Y, &W, &G));
  PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_SUCCEEDED));
  PetscCall(SNESLineSearchPreCheck(line, X, Y, &changed));
  PetscCall(self.model->residual_norms(F, &now));
  const double start = merit(self, now);
  PetscInt iteration;
  PetscCall(SNESGetIterationNumber(snes, &iteration));
  bool found = false;
  for (int k = 0; k < TRIES && !found; ++k) {
    PetscCall(VecWAXPY(W, -lambda, Y, X));
    PetscCall(SNESComputeFunction(snes, W, G));
    PetscCall(VecNorm(G, NORM_2, &fnorm));
    double phi = INFINITY;
    if (!PetscIsInfOrNanReal(fnorm)) {
      PetscCall(self.model->residual_norms(G, &now));
      phi = merit(self, now);
    }
    // at rounding level a direction is noise: take it, and let the convergence test judge
    found = phi <= (1 - 1e-4 * lambda) * start || (start < NOISE && phi < 10 * NOISE);
    found |= k == 0 && iteration < BOLD && phi < UPHILL;
    if (found) break;
    const double fit = std::isfinite(phi) ? lambda * lambda / (phi * phi / (start * start) - 1 + 2 * lambda) : 0.5 * lambda;
    lambda = std::clamp(fit, 0.1 * lambda, 0.5 * lambda);
  }
  if (!found) {
    PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_FAILED_REDUCT));
    PetscFunctionReturn(0);
  }
  PetscCall(VecNorm(Y, NORM_2, &ynorm));
  PetscCall(VecCopy(W, X));
  PetscCall(VecCopy(G, F));
  PetscCall(VecNorm(X, NORM_2, &xnorm));
  PetscCall(SNESLineSearchSetLambda(line, lambda));
  PetscCall(SNESLineSearchSetNorms(line, xnorm, fnorm, ynorm));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode NewtonPolicy::attach(TS stepper, SNES snes) {
  char type[64] = SNESNEWTONLS;
  PetscBool given = PETSC_FALSE;
  PetscFunctionBegin;
  ts = stepper;
  PetscCall(SNESSetConvergenceTest(snes, test, this, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-snes_type", type, sizeof(type), nullptr));
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-snes_linesearch_type", &given));
  if (given || std::strcmp(type, SNESNEWTONLS) != 0) PetscFunctionReturn(0);
  SNESLineSearch line;
  PetscCall(SNESGetLineSearch(snes, &line));
  PetscCall(SNESLineSearchSetType(line, SNESLINESEARCHSHELL));
  PetscCall(SNESLineSearchShellSetUserFunc(line, search, this));
  PetscFunctionReturn(0);
}

}  // namespace bs
