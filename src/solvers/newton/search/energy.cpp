#include "solvers/newton/search/energy.hpp"
#include <algorithm>
#include <cmath>

namespace bs {
namespace {

/// A trial that was refused: lambda, and Phi(lambda) - Phi(0).
struct Trial {
  double lambda = 0, change = 0;
};

// The minimum of the parabola through Phi(0), its slope and Phi(lambda), or of the cubic that also meets the trial before.
double next_lambda(double slope, const Trial& now, const Trial& before, PetscInt order) {
  const double l = now.lambda, m = before.lambda;
  double fit = 0.5 * l;
  if (std::isfinite(now.change)) fit = -0.5 * slope * l * l / (now.change - slope * l);
  if (order >= 3 && m > 0 && std::isfinite(now.change) && std::isfinite(before.change)) {
    const double p = (now.change - slope * l) / (l * l), q = (before.change - slope * m) / (m * m);
    const double a = (p - q) / (l - m), b = (l * q - m * p) / (l - m), root = b * b - 3 * a * slope;
    if (a != 0 && root >= 0) fit = (-b + std::sqrt(root)) / (3 * a);
  }
  return std::isfinite(fit) ? std::clamp(fit, 0.1 * l, 0.5 * l) : 0.5 * l;
}

PetscErrorCode print_trial(const EnergyLine& s, double lambda, double change, const char* verdict) {
  PetscFunctionBegin;
  if (s.limits.monitor)
    PetscCall(PetscViewerASCIIPrintf(s.limits.monitor, "      Line search: energy: lambda %g, change %g, slope %g: %s\n", lambda, change, s.slope,
                                     verdict));
  PetscFunctionReturn(0);
}

// Beside a saddle of Phi a definite tangent leads away from it in steps that are far too short: Phi falls almost as steeply at
// their end as at their start, that is beyond(lambda) is far below the -slope/2 of a step to the minimum. Such a step is
// doubled while Phi falls.
PetscErrorCode lengthen(EnergyLine* s, double beyond, Trial* now, PetscReal* fnorm) {
  constexpr double SHORT = 1.0 / 6;
  constexpr int MOST = 12;
  PetscReal norm = 0;
  PetscFunctionBegin;
  if (beyond > -SHORT * now->lambda * s->slope) PetscFunctionReturn(0);
  Trial longer = *now;
  for (int k = 0; k < MOST; ++k) {
    PotentialChange there;
    const double lambda = 2 * longer.lambda;
    PetscCall(s->beyond_slope(lambda, &there));
    const double change = lambda * s->slope + there.value;
    if (lambda > s->most || !(change < longer.change)) break;
    longer = {lambda, change};
  }
  if (longer.lambda == now->lambda) PetscFunctionReturn(0);
  PetscCall(s->evaluate(longer.lambda, &norm));
  if (PetscIsInfOrNanReal(norm)) {
    PetscCall(s->evaluate(now->lambda, fnorm));
    PetscFunctionReturn(0);
  }
  *now = longer;
  *fnorm = norm;
  PetscCall(print_trial(*s, now->lambda, now->change, "taken, lengthened"));
  PetscFunctionReturn(0);
}

/// The first lambda that lowers Phi enough and whose state has a residual; W and G are of it.
PetscErrorCode backtrack(EnergyLine* s, double* lambda, PetscReal* fnorm, bool* found) {
  Trial now, before;
  PetscFunctionBegin;
  *found = false;
  now.lambda = std::min(s->limits.damping, s->most);
  for (PetscInt k = 0; k < s->limits.most && now.lambda >= s->limits.min_lambda; ++k) {
    PotentialChange beyond;
    PetscCall(s->beyond_slope(now.lambda, &beyond));
    const double slope = now.lambda * s->slope, noise = beyond.noise + now.lambda * s->noise;
    now.change = slope + beyond.value;
    bool lower = now.change <= s->newton.search.past.highest() + s->limits.alpha * slope;
    const bool within_noise = std::abs(now.change) <= noise;
    if (lower || within_noise) {  // a change of Phi within its rounding errors says nothing: the slope at the trial decides
      PetscCall(s->evaluate(now.lambda, fnorm));
      if (PetscIsInfOrNanReal(*fnorm)) {
        lower = false;
        now.change = INFINITY;
      } else if (!lower) {
        PetscCall(s->slope_has_fallen(&lower));
      }
    }
    PetscCall(print_trial(*s, now.lambda, now.change, lower ? "taken" : "refused"));
    if (lower && k == 0 && !within_noise) PetscCall(lengthen(s, beyond.value, &now, fnorm));
    if (lower) {
      s->newton.search.past.moved(now.change);
      *lambda = now.lambda;
      *found = true;
      break;
    }
    ++s->newton.search.cuts;
    const double next = next_lambda(s->slope, now, before, s->limits.order);
    before = now;
    now.lambda = next;
  }
  PetscFunctionReturn(0);
}

/// The full step, where it leaves so little of the forces that the energy need not be asked.
PetscErrorCode try_full_step(EnergyLine* s, Vec F, PetscReal* fnorm, bool* taken) {
  double left = 0;
  PetscFunctionBegin;
  *taken = false;
  if (s->limits.damping != 1 || s->limits.full_step <= 0 || s->potential.limits_steps()) PetscFunctionReturn(0);
  PetscCall(s->evaluate(1, fnorm));
  if (PetscIsInfOrNanReal(*fnorm)) PetscFunctionReturn(0);
  s->full = *fnorm;
  PetscCall(s->forces_left(F, &left));
  *taken = left <= s->limits.full_step;
  PetscFunctionReturn(0);
}

// S is indefinite where a direction leads uphill: Newton is on its way to a saddle, or far from anything. Residual norms may
// find a way on; where they are asked again and again, the step is too long.
PetscErrorCode climb(const EnergyLine& s, SNESLineSearch line) {
  constexpr PetscInt MOST_UPHILL = 4;
  SNESLineSearchReason reason;
  PotentialChange beyond;
  PetscReal lambda;
  PetscFunctionBegin;
  ++s.newton.search.uphill;
  if (++s.newton.search.past.uphill > MOST_UPHILL) {
    PetscCall(print_trial(s, 0, 0, "not downhill, given up"));
    PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_FAILED_REDUCT));
    PetscFunctionReturn(0);
  }
  PetscCall(print_trial(s, 0, 0, "not downhill, by residual norms"));
  PetscCall(guarded_search(line, s.newton));
  PetscCall(SNESLineSearchGetReason(line, &reason));
  if (reason != SNES_LINESEARCH_SUCCEEDED) PetscFunctionReturn(0);
  PetscCall(SNESLineSearchGetLambda(line, &lambda));
  if (s.potential.limits_steps()) PetscCall(s.potential.follow(s.X, s.line));  // the guarded search had followed another line
  PetscCall(s.beyond_slope(lambda, &beyond));
  s.newton.search.past.moved(lambda * s.slope + beyond.value);
  PetscFunctionReturn(0);
}

}  // namespace

std::string lacks_energy(const NewtonSettings& settings) {
  if (!settings.affine) return "this -ts_type";
  if (!settings.model->incremental()) return "this system";
  return settings.model->incremental()->lacks_potential();
}

PetscErrorCode energy_search(SNESLineSearch line, NewtonPolicy& newton, const EnergyLimits& limits) {
  PetscBool changed = PETSC_FALSE;
  PetscReal fnorm = 0, lambda = 1;
  Vec F;
  PetscInt iteration;
  bool found = false;
  PetscFunctionBegin;
  // sigma is known from the Jacobian of this stage; where there was none, or an older one, Phi is not
  if (!lacks_energy(newton.settings()).empty() || !newton.stage.has_jacobian()) {
    PetscCall(guarded_search(line, newton));
    PetscFunctionReturn(0);
  }
  EnergyLine s{newton, limits, *newton.model().incremental()};
  PetscCall(SNESLineSearchGetSNES(line, &s.snes));
  PetscCall(SNESLineSearchGetVecs(line, &s.start, &F, &s.Y, &s.W, &s.G));
  PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_SUCCEEDED));
  PetscCall(SNESLineSearchPreCheck(line, s.start, s.Y, &changed));
  PetscCall(SNESGetIterationNumber(s.snes, &iteration));
  if (iteration == 0) newton.search.past = {};
  PetscCall(try_full_step(&s, F, &fnorm, &found));
  if (found) {
    newton.search.past.forget();
    PetscCall(s.accept(line, F, lambda, fnorm));
    PetscFunctionReturn(0);
  }
  PetscCall(s.set_up(F));
  if (std::abs(s.slope) <= s.noise) {
    // at rounding level a direction is noise: take it, and let the convergence test judge
    lambda = std::min(1.0, s.most);
    PetscCall(s.evaluate(lambda, &fnorm));
    found = !PetscIsInfOrNanReal(fnorm);
    newton.search.past.moved(0);
  } else if (s.slope > 0) {
    PetscCall(climb(s, line));
    PetscFunctionReturn(0);
  } else {
    PetscCall(backtrack(&s, &lambda, &fnorm, &found));
  }
  if (found) PetscCall(s.accept(line, F, lambda, fnorm));
  else PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_FAILED_REDUCT));
  PetscFunctionReturn(0);
}

}  // namespace bs
