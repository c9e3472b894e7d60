#include "solve/search/energy.hpp"
#include <petsc/private/linesearchimpl.h>
#include <algorithm>
#include <cmath>
#include "solve/search/guarded.hpp"

namespace bs {
namespace {

/// State of one search. Trials are W = X + lambda line on F_x = 0; a full step is Newton's own in every bit.
struct Search {
  NewtonPolicy& newton;
  const EnergyLimits& limits;
  Incremental& potential;
  SNES snes = nullptr;
  Vec start = nullptr, Y = nullptr;  ///< Newton's iterate and direction
  Vec X = nullptr, F = nullptr, line = nullptr, W = nullptr, G = nullptr;
  double slope = 0;  ///< F_v . dv at lambda = 0
  double noise = 0;  ///< rounding error of the slope
  PetscReal full = -1;  ///< |G| while W and G are the full step's
};

/// Sums over owned particles: a_v . b_v and b_v . b_v.
PetscErrorCode velocity_products(MPI_Comm comm, PetscInt d, Vec a, Vec b, double* ab, double* bb) {
  const PetscScalar *pa = nullptr, *pb = nullptr;
  PetscInt n = 0;
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(a, &n));
  PetscCall(VecGetArrayRead(a, &pa));
  PetscCall(VecGetArrayRead(b, &pb));
  for (PetscInt i = 0; i < n; i += 2 * d)
    for (PetscInt v = i + d; v < i + 2 * d; ++v) {
      sums[0] += pa[v] * pb[v];
      sums[1] += pb[v] * pb[v];
    }
  PetscCall(VecRestoreArrayRead(b, &pb));
  PetscCall(VecRestoreArrayRead(a, &pa));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, comm));
  *ab = sums[0];
  *bb = sums[1];
  PetscFunctionReturn(0);
}

/// z_x = z_v/sigma
PetscErrorCode condense_line(PetscInt d, double sigma, Vec z) {
  PetscScalar* a = nullptr;
  PetscInt n = 0;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(z, &n));
  PetscCall(VecGetArray(z, &a));
  for (PetscInt i = 0; i < n; i += 2 * d)
    for (PetscInt x = i; x < i + d; ++x) a[x] = a[x + d] / sigma;
  PetscCall(VecRestoreArray(z, &a));
  PetscFunctionReturn(0);
}

// With F_x = 0 at (x, v + a), a = M^-1 F_x, and the full step at v - y_v, whose F_x is 0 too:
//   line: dv = -(y_v + a),  dx = dv/sigma
// Newton's linear solve leaves dx = -y_x up to its tolerance. The residual there is F where a = 0, else evaluated.
PetscErrorCode set_line(Search* s) {
  ResidualNorms now;
  PetscReal speed = 0;
  PetscFunctionBegin;
  Model& model = *s->newton.model;
  PetscCall(s->potential.add_kinematic(s->F, s->line));
  PetscCall(VecScale(s->line, -1.0));
  PetscCall(condense_line(model.dim(), s->newton.stage_sigma, s->line));
  PetscCall(model.residual_norms(s->F, &now));
  PetscCall(s->potential.add_kinematic(s->F, s->X));
  if (now[0] > s->newton.floor[0]) PetscCall(SNESComputeFunction(s->snes, s->X, s->F));
  PetscCall(velocity_products(model.comm(), model.dim(), s->F, s->line, &s->slope, &speed));
  s->noise = s->newton.floor[1] * std::sqrt(speed);
  PetscCall(s->potential.follow(s->X, s->line));
  PetscFunctionReturn(0);
}

/// The trial state and its residual; `fnorm` not finite: a law has no value there.
PetscErrorCode evaluate(Search* s, double lambda, PetscReal* fnorm) {
  PetscFunctionBegin;
  if (lambda == 1 && s->full >= 0) {
    *fnorm = s->full;
    PetscFunctionReturn(0);
  }
  s->full = -1;
  if (lambda == 1) PetscCall(VecWAXPY(s->W, -1.0, s->Y, s->start));
  else PetscCall(VecWAXPY(s->W, lambda, s->line, s->X));
  PetscCall(SNESComputeFunction(s->snes, s->W, s->G));
  PetscCall(VecNorm(s->G, NORM_2, fnorm));
  PetscFunctionReturn(0);
}

// Where Phi's change drowns in rounding, its slope at the trial tells (Hager and Zhang's approximate condition):
//   g(lambda).dv <= (2 alpha - 1) g(0).dv
PetscErrorCode slope_is_well(Search* s, bool* well) {
  double there = 0, speed = 0;
  PetscFunctionBegin;
  PetscCall(velocity_products(s->newton.model->comm(), s->newton.model->dim(), s->G, s->line, &there, &speed));
  *well = there <= (2 * s->limits.alpha - 1) * s->slope + s->noise;
  PetscFunctionReturn(0);
}

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

PetscErrorCode tell(const Search& s, double lambda, double change, const char* verdict) {
  PetscFunctionBegin;
  if (s.limits.monitor)
    PetscCall(PetscViewerASCIIPrintf(s.limits.monitor, "      Line search: energy: lambda %g, change %g, slope %g: %s\n", lambda, change, s.slope, verdict));
  PetscFunctionReturn(0);
}

// Beside a saddle of Phi a definite tangent leads away from it in steps that are far too short: Phi falls almost as steeply at
// their end as at their start, that is beyond(lambda) is far below the -slope/2 of a step to the minimum. Such a step is
// doubled while Phi falls.
PetscErrorCode lengthen(Search* s, double beyond, Trial* now, PetscReal* fnorm) {
  constexpr double SHORT = 1.0 / 6;
  constexpr int MOST = 12;
  PetscReal norm = 0;
  PetscFunctionBegin;
  if (beyond > -SHORT * now->lambda * s->slope) PetscFunctionReturn(0);
  Trial longer = *now;
  for (int k = 0; k < MOST; ++k) {
    PotentialChange there;
    const double lambda = 2 * longer.lambda;
    PetscCall(s->potential.beyond_slope(s->newton.stage_time, s->newton.stage_sigma, lambda, &there));
    const double change = lambda * s->slope + there.value;
    if (!(change < longer.change)) break;
    longer = {lambda, change};
  }
  if (longer.lambda == now->lambda) PetscFunctionReturn(0);
  PetscCall(evaluate(s, longer.lambda, &norm));
  if (PetscIsInfOrNanReal(norm)) {
    PetscCall(evaluate(s, now->lambda, fnorm));
    PetscFunctionReturn(0);
  }
  *now = longer;
  *fnorm = norm;
  PetscCall(tell(*s, now->lambda, now->change, "taken, lengthened"));
  PetscFunctionReturn(0);
}

/// The first lambda that lowers Phi enough and whose state has a residual; W and G are of it.
PetscErrorCode backtrack(Search* s, double* lambda, PetscReal* fnorm, bool* found) {
  Trial now, before;
  PetscFunctionBegin;
  *found = false;
  now.lambda = s->limits.damping;
  for (PetscInt k = 0; k < s->limits.most && now.lambda >= s->limits.min_lambda; ++k) {
    PotentialChange beyond;
    PetscCall(s->potential.beyond_slope(s->newton.stage_time, s->newton.stage_sigma, now.lambda, &beyond));
    const double slope = now.lambda * s->slope, noise = beyond.noise + now.lambda * s->noise;
    now.change = slope + beyond.value;
    bool lower = now.change <= s->newton.past.highest() + s->limits.alpha * slope;
    const bool drowned = std::abs(now.change) <= noise;
    if (lower || drowned) {
      PetscCall(evaluate(s, now.lambda, fnorm));
      if (PetscIsInfOrNanReal(*fnorm)) {
        lower = false;
        now.change = INFINITY;
      } else if (!lower) {
        PetscCall(slope_is_well(s, &lower));
      }
    }
    PetscCall(tell(*s, now.lambda, now.change, lower ? "taken" : "refused"));
    if (lower && k == 0 && !drowned) PetscCall(lengthen(s, beyond.value, &now, fnorm));
    if (lower) {
      s->newton.past.moved(now.change);
      *lambda = now.lambda;
      *found = true;
      break;
    }
    ++s->newton.tally.cuts;
    const double next = next_lambda(s->slope, now, before, s->limits.order);
    before = now;
    now.lambda = next;
  }
  PetscFunctionReturn(0);
}

// S is indefinite where a direction leads uphill: Newton is on its way to a saddle, or far from anything. Residual norms may
// find a way on; where they are asked again and again, the step is too long.
PetscErrorCode climb(const Search& s, SNESLineSearch line) {
  constexpr PetscInt BORNE = 4;
  SNESLineSearchReason reason;
  PotentialChange beyond;
  PetscReal lambda;
  PetscFunctionBegin;
  ++s.newton.tally.uphill;
  if (++s.newton.past.uphill > BORNE) {
    PetscCall(tell(s, 0, 0, "not downhill, given up"));
    PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_FAILED_REDUCT));
    PetscFunctionReturn(0);
  }
  PetscCall(tell(s, 0, 0, "not downhill, by residual norms"));
  PetscCall(guarded_search(line, s.newton));
  PetscCall(SNESLineSearchGetReason(line, &reason));
  if (reason != SNES_LINESEARCH_SUCCEEDED) PetscFunctionReturn(0);
  PetscCall(SNESLineSearchGetLambda(line, &lambda));
  PetscCall(s.potential.beyond_slope(s.newton.stage_time, s.newton.stage_sigma, lambda, &beyond));
  s.newton.past.moved(lambda * s.slope + beyond.value);
  PetscFunctionReturn(0);
}

/// W and G become Newton's iterate and residual.
PetscErrorCode accept(SNESLineSearch line, const Search& s, Vec F, PetscReal lambda, PetscReal fnorm) {
  PetscReal xnorm, ynorm;
  PetscFunctionBegin;
  PetscCall(VecNorm(s.Y, NORM_2, &ynorm));
  PetscCall(VecCopy(s.W, s.start));
  PetscCall(VecCopy(s.G, F));
  PetscCall(VecNorm(s.start, NORM_2, &xnorm));
  PetscCall(SNESLineSearchSetLambda(line, lambda));
  PetscCall(SNESLineSearchSetNorms(line, xnorm, fnorm, ynorm));
  PetscFunctionReturn(0);
}

}  // namespace

std::string lacks_energy(const NewtonPolicy& newton) {
  if (!newton.affine) return "this -ts_type";
  if (!newton.model->incremental()) return "this system";
  return newton.model->incremental()->lacks_potential();
}

PetscErrorCode energy_search(SNESLineSearch line, NewtonPolicy& newton, const EnergyLimits& limits) {
  PetscBool changed = PETSC_FALSE;
  PetscReal fnorm = 0, lambda = 1;
  Vec F;
  PetscInt iteration;
  bool found = false;
  PetscFunctionBegin;
  // sigma is known from the Jacobian of this stage; where there was none, or an older one, Phi is not
  if (!lacks_energy(newton).empty() || newton.stage_sigma <= 0 || newton.stage_time != newton.residual_time) {
    PetscCall(guarded_search(line, newton));
    PetscFunctionReturn(0);
  }
  Search s{newton, limits, *newton.model->incremental()};
  PetscCall(SNESLineSearchGetSNES(line, &s.snes));
  PetscCall(SNESLineSearchGetVecs(line, &s.start, &F, &s.Y, &s.W, &s.G));
  PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_SUCCEEDED));
  PetscCall(SNESLineSearchPreCheck(line, s.start, s.Y, &changed));
  PetscCall(SNESGetIterationNumber(s.snes, &iteration));
  if (iteration == 0) newton.past = {};
  if (limits.damping == 1 && limits.unasked > 0) {
    PetscReal before = 0;
    PetscCall(SNESLineSearchGetNorms(line, nullptr, &before, nullptr));
    PetscCall(evaluate(&s, lambda, &fnorm));
    if (!PetscIsInfOrNanReal(fnorm)) s.full = fnorm;
    if (s.full >= 0 && fnorm <= limits.unasked * before) {
      newton.past.forget();
      PetscCall(accept(line, s, F, lambda, fnorm));
      PetscFunctionReturn(0);
    }
  }
  PetscCall(SNESLineSearchSetWorkVecs(line, 3));
  s.line = line->work[0];
  s.X = line->work[1];
  s.F = line->work[2];
  PetscCall(VecCopy(s.Y, s.line));
  PetscCall(VecCopy(s.start, s.X));
  PetscCall(VecCopy(F, s.F));
  PetscCall(set_line(&s));
  if (std::abs(s.slope) <= s.noise) {
    // at rounding level a direction is noise: take it, and let the convergence test judge
    PetscCall(evaluate(&s, lambda, &fnorm));
    found = !PetscIsInfOrNanReal(fnorm);
    newton.past.moved(0);
  } else if (s.slope > 0) {
    PetscCall(climb(s, line));
    PetscFunctionReturn(0);
  } else {
    PetscCall(backtrack(&s, &lambda, &fnorm, &found));
  }
  if (!found) {
    PetscCall(SNESLineSearchSetReason(line, SNES_LINESEARCH_FAILED_REDUCT));
    PetscFunctionReturn(0);
  }
  PetscCall(accept(line, s, F, lambda, fnorm));
  PetscFunctionReturn(0);
}

}  // namespace bs
