#include "solvers/newton/convergence.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/petsc_versions.hpp"
#include "base/rounding.hpp"
#include "solvers/newton/search/energy.hpp"

namespace bs {

/// Iterates in a row without progress after which the solve of an equilibrium gives up.
static constexpr int PATIENCE = 4;

/// What SNES hands to its convergence test: iteration, |x|, |dx|, |F|, and the tolerances in force.
struct NewtonPolicy::Norms {
  PetscInt it = 0;
  PetscReal x = 0, step = 0, F = 0;
  PetscReal atol = 0, rtol = 0, stol = 0, divtol = 0;
};

/// Whether either part is below rtol of its first, or below `floors` times the rounding errors of the forces.
bool NewtonPolicy::below(const ResidualNorms& now, double rtol, double floors) const {
  const ResidualNorms &first = solve_.first, &floor = solve_.floor;
  // a momentum residual that starts at nothing (free flight) is judged by the velocity error it makes, to 1e-4 rtol
  const double kinematic = std::max(first[0], first[1] / solve_.inverse_h);
  const double momentum = std::max(first[1], 1e-4 * solve_.inverse_h * first[0]);
  return now[0] <= std::max(rtol * kinematic, floors * floor[0]) && now[1] <= std::max(rtol * momentum, floors * floor[1]);
}

/// Whether the residual has fallen to this part of the first one, or has been of the size of its rounding errors: now, or from the start, as that of
/// a body at rest, which an iteration may make greater.
bool NewtonPolicy::has_fallen(const ResidualNorms& now, double part) const {
  constexpr double NEAR = 100;
  return below(now, part, NEAR) || (solve_.first[0] <= NEAR * solve_.floor[0] && solve_.first[1] <= NEAR * solve_.floor[1]);
}

/// Near rounding level, and no longer falling: no further iterate is any better. The estimate of the rounding errors is a sum
/// of the worst cases, which Newton may well get below; so what the residual does decides. Beside stiff springs soft ones may still be far from
/// that level where the norms are near it: equilibria wait for several iterates before they give up.
bool NewtonPolicy::exhausted(const ResidualNorms& now, double rtol) const {
  constexpr double NEAR = 100, ROUNDING = 1e-13;
  const double size = ROUNDING * solve_.size_of_forces();
  const bool near = below(now, rtol, NEAR) || (solve_.inverse_h * now[0] <= size && now[1] <= size);
  const bool falling = now[0] < 0.5 * solve_.previous[0] || now[1] < 0.5 * solve_.previous[1];
  if (to_rounding_) return near && (solve_.stalled >= PATIENCE || (!falling && below(now, rtol, 1.0)));
  return near && !falling;
}

// Inexact Newton: a linear solve need not be better than Newton's own quadratic convergence lets it be, nor than what is
// left to do. eta = FIRST at first, then (|F_k|/|F_k-1|)^2 within [LEAST, FIRST], but at least SAFETY times the reduction
// that is still missing. Measured on blocks of 64,000 particles, plain and with 1 % of the springs 10^4 times stiffer, h omega
// 25 and 250: Krylov iterations fall by 7, 4, 2 and 22 % against FIRST = 1e-3, LEAST = 1e-8, for at most three Newton
// iterations more in five steps.
PetscErrorCode NewtonPolicy::set_forcing(SNES snes, PetscInt it, const ResidualNorms& now, double rtol) const {
  constexpr double FIRST = 1e-2, LEAST = 1e-3, SAFETY = 0.5;
  KSP ksp;
  PetscFunctionBegin;
  const double size = as_force(now), before = as_force(solve_.previous);
  const double goal = std::max(rtol * std::max(solve_.first[1], 1e-4 * solve_.inverse_h * solve_.first[0]), solve_.floor[1]);
  const double quadratic = it == 0 || before <= 0 ? FIRST : (size / before) * (size / before);
  const double eta = std::max(std::clamp(quadratic, LEAST, FIRST), std::min(SAFETY * goal / size, 0.1));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPSetTolerances(ksp, eta, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

// The norms over everything may have converged for the sake of the heaviest or stiffest part alone: no particle may be left
// with forces that stand for a velocity error of more than PART of the largest speed, or a hundred rtol. One pass over two vectors, made only
// where the norms have converged.
PetscErrorCode NewtonPolicy::all_particles_converged(SNES snes, double rtol, bool* yes) {
  constexpr double PART = 1e-6;
  double worst = 0, fastest = 0;
  Vec X, F;
  PetscFunctionBegin;
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(SNESGetFunction(snes, &F, nullptr, nullptr));
  PetscCall(model().velocity_errors(X, F, solve_.inverse_h, settings_.form, &worst, &fastest));
  *yes = worst <= std::max(PART, 100 * rtol) * fastest;
  if (*yes || (solve_.worst > 0 && worst >= 0.5 * solve_.worst)) PetscFunctionReturn(0);
  solve_.worst = worst;
  solve_.stalled = 0;
  PetscFunctionReturn(0);
}

void PastLengths::begin(double length) {
  if (open) failed = failed > 0 ? std::min(failed, h) : h;
  h = length;
  open = true;
}

void PastLengths::converged(PetscInt iterations) {
  open = false;
  if (h >= failed * (1 - SAME_STEP)) failed = 0;
  else rate = static_cast<double>(std::max<PetscInt>(iterations, 1)) / h;
}

// A length that was rejected is tried again now and then. It is worth no more iterations than the shorter steps in its place.
bool PastLengths::exceeded(PetscInt iterations) const {
  constexpr double FEWEST = 20;
  return failed > 0 && rate > 0 && h >= failed * (1 - SAME_STEP) && static_cast<double>(iterations) >= std::max(FEWEST, rate * h);
}

bool NewtonPolicy::in_vain(PetscInt iterations) {
  gave_up_ = "";
  if (lengths_.exceeded(iterations)) gave_up_ = "a longer step, tried again, took more Newton iterations than the shorter steps in its place";
  else if (longest_idle_ > 0 && solve_.idle >= longest_idle_) gave_up_ = format("%d Newton iterations made no progress", longest_idle_);
  return !gave_up_.empty();
}

void NewtonPolicy::save(Facts* facts) const {
  facts->real["lengths_last"] = lengths_.h;
  facts->real["lengths_failed"] = lengths_.failed;
  facts->real["lengths_rate"] = lengths_.rate;
  facts->whole["lengths_open"] = lengths_.open ? 1 : 0;
  facts->whole["newton_loose"] = loose_;
}

void NewtonPolicy::restore(const Facts& facts) {
  lengths_.h = facts.real_of("lengths_last");
  lengths_.failed = facts.real_of("lengths_failed");
  lengths_.rate = facts.real_of("lengths_rate");
  lengths_.open = facts.whole_of("lengths_open") != 0;
  loose_ = facts.whole_of("newton_loose");
}

PetscErrorCode NewtonPolicy::test(SNES snes, PetscInt it, PetscReal xnorm, PetscReal snorm, PetscReal fnorm, SNESConvergedReason* reason,
                                  void* self) {
  Norms at;
  PetscFunctionBegin;
  at.it = it;
  at.x = xnorm;
  at.step = snorm;
  at.F = fnorm;
  PetscCall(SNESGetTolerances(snes, &at.atol, &at.rtol, &at.stol, nullptr, nullptr));
  PetscCall(SNESGetDivergenceTolerance(snes, &at.divtol));
  PetscCall(static_cast<NewtonPolicy*>(self)->judge(snes, at, reason));
  PetscFunctionReturn(0);
}

PetscErrorCode NewtonPolicy::begin_solve(const ResidualNorms& now) {
  NewtonStep step;
  PetscFunctionBegin;
  PetscCall(settings_.step(&step));
  solve_.inverse_h = 1 / step.h;
  lengths_.begin(step.h);
  if (solve_.inverse_h != floor_inverse_h_) PetscCall(estimate_floor(solve_.inverse_h));
  for (int k = 0; k < 2; ++k) solve_.first[k] = std::max(now[k], reference_[k]);
  reference_ = {0, 0};
  solve_.least = now;
  solve_.worst = 0;
  solve_.stalled = solve_.idle = 0;
  solve_.fallen = 0;
  PetscFunctionReturn(0);
}

void NewtonSolve::follow(const ResidualNorms& now, double fall) {
  constexpr double GREATER = 1.01;
  const bool better = now[0] < 0.5 * least[0] || now[1] < 0.5 * least[1];
  for (int k = 0; k < 2; ++k)
    if (now[k] < 0.5 * least[k]) least[k] = now[k];
  stalled = better ? 0 : stalled + 1;
  const bool lower = fall > GREATER * fallen;
  if (lower) fallen = fall;
  idle = better || lower ? 0 : idle + 1;
}

// Converged: every part has fallen by rtol, or to its rounding errors and falls no further, or all of F is below atol, or a
// whole Newton step below stol of the state. Diverged: grown by the divergence tolerance, unless the search makes the potential fall, whose gradient
// may grow on the way past a stiff spring, and the user has not asked for it.
SNESConvergedReason NewtonPolicy::verdict(const Norms& at, const ResidualNorms& now) const {
  constexpr double FAR = 1e-4;
  const double whole = std::hypot(solve_.first[0], solve_.first[1]);
  if (at.F < at.atol) return SNES_CONVERGED_FNORM_ABS;
  if (at.it > 0 ? below(now, at.rtol, 0.0) : below(now, 0.0, 1.0)) return SNES_CONVERGED_FNORM_RELATIVE;
  if (at.it == 0) return SNES_CONVERGED_ITERATING;
  if (exhausted(now, at.rtol)) return SNES_CONVERGED_FNORM_RELATIVE;
  // a step of nothing is no sign of convergence where the linear solver has done nothing (-ksp_atol 1e10)
  if (at.step < at.stol * at.x) return has_fallen(now, FAR) ? SNES_CONVERGED_SNORM_RELATIVE : SNES_DIVERGED_LINEAR_SOLVE;
  if (!descends_ && at.divtol > 0 && whole > 0 && at.F > at.divtol * whole) return SNES_DIVERGED_DTOL;
  return SNES_CONVERGED_ITERATING;
}

/// The norms have converged. So must the residual of every single particle, as long as iterates still improve.
PetscErrorCode NewtonPolicy::confirm(SNES snes, const Norms& at, const ResidualNorms& now, SNESConvergedReason* reason) {
  bool all = true;
  PetscFunctionBegin;
  PetscCall(all_particles_converged(snes, at.rtol, &all));
  if (!all && !(to_rounding_ && exhausted(now, at.rtol) && solve_.stalled >= PATIENCE)) {
    *reason = SNES_CONVERGED_ITERATING;
    ++uneven_;
  } else if (at.it > 0 && !below(now, at.rtol, 0.0)) {
    ++at_floor_;
  }
  PetscFunctionReturn(0);
}

/// -snes_max_funcs: evaluations of the residual in one solve.
PetscErrorCode NewtonPolicy::limit_evaluations(SNES snes, SNESConvergedReason* reason) const {
  PetscInt done = 0, most = 0;
  PetscFunctionBegin;
  PetscCall(SNESGetNumberFunctionEvals(snes, &done));
  PetscCall(SNESGetTolerances(snes, nullptr, nullptr, nullptr, nullptr, &most));
  if (most >= 0 && done >= most) *reason = SNES_DIVERGED_FUNCTION_COUNT;
  PetscFunctionReturn(0);
}

PetscErrorCode NewtonPolicy::judge(SNES snes, const Norms& at, SNESConvergedReason* reason) {
  constexpr double LOOSE = 1e-3;
  Vec F;
  ResidualNorms now;
  PetscFunctionBegin;
  *reason = NORM_NOT_FINITE;
  if (PetscIsInfOrNanReal(at.F)) PetscFunctionReturn(0);
  PetscCall(SNESGetFunction(snes, &F, nullptr, nullptr));
  PetscCall(model().residual_norms(F, &now));
  if (at.it == 0) PetscCall(begin_solve(now));
  else solve_.follow(now, search.past.fall);
  *reason = verdict(at, now);
  if (*reason == SNES_CONVERGED_FNORM_RELATIVE || *reason == SNES_CONVERGED_SNORM_RELATIVE) PetscCall(confirm(snes, at, now, reason));
  if (*reason == SNES_CONVERGED_ITERATING && settings_.forcing) PetscCall(set_forcing(snes, at.it, now, at.rtol));
  if (*reason > 0) lengths_.converged(at.it);
  if (*reason > 0 && !has_fallen(now, LOOSE)) ++loose_;
  if (*reason == SNES_CONVERGED_ITERATING && settings_.directions && !all_iterations_ && in_vain(at.it)) *reason = SNES_DIVERGED_INNER;
  if (*reason == SNES_CONVERGED_ITERATING) PetscCall(limit_evaluations(snes, reason));
  solve_.previous = now;
  PetscFunctionReturn(0);
}

/// In load steps; what rounds off grows with them.
bool NewtonPolicy::loads_grow() const { return model().tangent() && !model().tangent()->has_inertia(); }

PetscErrorCode NewtonPolicy::estimate_floor(double inverse_h) {
  NewtonStep step;
  PetscFunctionBegin;
  PetscCall(settings_.step(&step));
  const double at = loads_grow() ? step.time + step.h : step.time;
  PetscCall(model().residual_floor(at, step.start, inverse_h, settings_.form, &solve_.floor));
  floor_inverse_h_ = inverse_h;
  PetscFunctionReturn(0);
}

PetscErrorCode NewtonPolicy::attach(SNES snes, const NewtonSettings& settings) {
  const bool newton = value_of("-snes_type", SNESNEWTONLS) == SNESNEWTONLS;
  PetscFunctionBegin;
  settings_ = settings;
  PetscCall(SNESSetConvergenceTest(snes, test, this, nullptr));
  PetscCall(set_search_policy(snes, this));
  settings_.directions = newton && value_of("-snes_linesearch_type", "energy") == "energy" && lacks_energy(settings_).empty();
  descends_ = settings_.directions && !is_given("-snes_divergence_tolerance");
  if (is_given("-snes_linesearch_type") || !newton) PetscFunctionReturn(0);
  SNESLineSearch line;
  PetscCall(SNESGetLineSearch(snes, &line));
  PetscCall(SNESLineSearchSetType(line, "energy"));
  PetscFunctionReturn(0);
}

}  // namespace bs
