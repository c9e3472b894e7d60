#include <petsc/private/linesearchimpl.h>  // of types of SNESLineSearch
#include <algorithm>
#include <cmath>
#include "base/attached.hpp"
#include "base/petsc_versions.hpp"
#include "solvers/newton/search/energy.hpp"

namespace bs {

namespace {

constexpr const char* POLICY = "backspring_newton";
constexpr const char *GUARDED = "guarded", *ENERGY = "energy";

/// The policy tied to the SNES of a search.
PetscErrorCode policy_of(SNESLineSearch line, NewtonPolicy** newton) {
  SNES snes;
  PetscFunctionBegin;
  PetscCall(SNESLineSearchGetSNES(line, &snes));
  *newton = attached<NewtonPolicy>(snes, POLICY);
  PetscCheck(*newton, PetscObjectComm(reinterpret_cast<PetscObject>(line)), PETSC_ERR_ARG_WRONGSTATE,
             "the line searches guarded and energy work only within the time stepper's own Newton solver");
  PetscFunctionReturn(0);
}

PetscErrorCode apply_guarded(SNESLineSearch line) {
  NewtonPolicy* newton = nullptr;
  PetscFunctionBegin;
  PetscCall(policy_of(line, &newton));
  PetscCall(guarded_search(line, *newton));
  PetscFunctionReturn(0);
}

PetscErrorCode create_guarded(SNESLineSearch line) {
  PetscFunctionBegin;
  line->ops->apply = apply_guarded;
  PetscFunctionReturn(0);
}

PetscErrorCode apply_energy(SNESLineSearch line) {
  NewtonPolicy* newton = nullptr;
  EnergyLimits limits = *static_cast<EnergyLimits*>(line->data);
  PetscFunctionBegin;
  PetscCall(policy_of(line, &newton));
  limits.damping = line->damping;
  limits.min_lambda = least_lambda(line);
  limits.most = most_trials(line);
  limits.order = line->order;
  limits.monitor = line->monitor;
  PetscCall(energy_search(line, *newton, limits));
  PetscFunctionReturn(0);
}

PetscErrorCode energy_options(SNESLineSearch line, OptionItems PetscOptionsObject) {
  EnergyLimits* limits = static_cast<EnergyLimits*>(line->data);
  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "Line search by energy");
  PetscCall(PetscOptionsReal("-snes_linesearch_alpha",
                             "fraction of the slope by which the energy must decrease; forces without a potential are searched by residual norms", "",
                             limits->alpha, &limits->alpha, nullptr));
  PetscCall(PetscOptionsReal("-snes_linesearch_full_step_rtol",
                             "a full step that reduces the forces to this fraction is accepted without computing the energy; 0: compute it always",
                             "", limits->full_step, &limits->full_step, nullptr));
  PetscOptionsHeadEnd();
  PetscFunctionReturn(0);
}

PetscErrorCode destroy_energy(SNESLineSearch line) {
  PetscFunctionBegin;
  delete static_cast<EnergyLimits*>(line->data);
  line->data = nullptr;
  PetscFunctionReturn(0);
}

PetscErrorCode create_energy(SNESLineSearch line) {
  PetscFunctionBegin;
  line->data = new EnergyLimits;
  most_trials(line) = EnergyLimits{}.most;
  line->order = EnergyLimits{}.order;
  line->ops->apply = apply_energy;
  line->ops->setfromoptions = energy_options;
  line->ops->destroy = destroy_energy;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode register_searches() {
  PetscFunctionBegin;
  PetscCall(SNESLineSearchRegister(GUARDED, create_guarded));
  PetscCall(SNESLineSearchRegister(ENERGY, create_energy));
  PetscFunctionReturn(0);
}

PetscErrorCode set_search_policy(SNES snes, NewtonPolicy* newton) {
  PetscFunctionBegin;
  PetscCall(attach(snes, POLICY, newton));
  PetscFunctionReturn(0);
}

PetscErrorCode searches_within_limits(SNES snes, bool* yes) {
  PetscBool newton = PETSC_FALSE;
  SNESLineSearch line;
  SNESLineSearchType type = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESNEWTONLS, &newton));
  PetscCall(SNESGetLineSearch(snes, &line));
  PetscCall(SNESLineSearchGetType(line, &type));
  const std::string name = type ? type : "";
  *yes = newton && (name == GUARDED || name == ENERGY);
  PetscFunctionReturn(0);
}

PetscErrorCode describe_search(SNES snes, std::string* text) {
  SNESLineSearch line;
  SNESLineSearchType type = nullptr;
  PetscFunctionBegin;
  PetscCall(SNESGetLineSearch(snes, &line));
  PetscCall(SNESLineSearchGetType(line, &type));
  *text = type ? type : "default";
  if (*text == GUARDED) *text += " (full steps, then backtracking)";
  if (*text != ENERGY) PetscFunctionReturn(0);
  NewtonPolicy* newton = nullptr;
  PetscCall(policy_of(line, &newton));
  const std::string lack = lacks_energy(newton->settings());
  if (!lack.empty()) *text += " (residual norms: " + lack + " has no potential)";
  PetscFunctionReturn(0);
}

namespace {

// phi = |(F_x/h, F_v)| / max(|F_x|/h, |F_v|) of the first iterate, where a part below its rounding errors counts as 0
double merit(const NewtonPolicy& self, const ResidualNorms& now) {
  const double kinematic = now[0] > self.floor()[0] ? self.solve().inverse_h * now[0] : 0;
  const double momentum = now[1] > self.floor()[1] ? now[1] : 0;
  const double size = self.solve().size_of_forces();
  return std::hypot(kinematic, momentum) / (size > 0 ? size : 1);
}

/// Collective. The largest lambda that forces allow along X - lambda Y, at most 1; `work`: room.
PetscErrorCode largest_step(const NewtonPolicy& self, Vec X, Vec Y, Vec work, PetscReal* lambda) {
  Incremental* const forces = self.model().limits();
  double most = 1;
  PetscFunctionBegin;
  if (!forces) PetscFunctionReturn(0);
  PetscCall(VecCopy(Y, work));
  PetscCall(VecScale(work, -1.0));
  PetscCall(forces->follow(X, work));
  PetscCall(forces->largest_lambda(self.stage.time, &most));
  *lambda = std::min(1.0, most);
  PetscFunctionReturn(0);
}

}  // namespace

// The first BOLD iterations take full steps, also uphill: through stiff springs a good step first raises the residual by
// orders of magnitude, and searching for descent there costs ten times the iterations. What has not converged by then
// (full Newton can cycle) goes on by backtracking on phi: phi(lambda) <= (1 - 1e-4 lambda) phi(0), the next lambda from the
// parabola through phi(0)^2, its Newton slope -2 phi(0)^2 and phi(lambda)^2, within [0.1, 0.5] lambda.
PetscErrorCode guarded_search(SNESLineSearch line, const NewtonPolicy& self) {
  constexpr int TRIES = 30, BOLD = 10;
  constexpr double UPHILL = 1e4, NOISE = 1e-12;
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
  PetscCall(self.model().residual_norms(F, &now));
  const double start = merit(self, now);
  PetscInt iteration;
  PetscCall(SNESGetIterationNumber(snes, &iteration));
  bool found = false;
  PetscCall(largest_step(self, X, Y, W, &lambda));
  for (int k = 0; k < TRIES && !found && lambda > 0; ++k) {
    PetscCall(VecWAXPY(W, -lambda, Y, X));
    PetscCall(SNESComputeFunction(snes, W, G));
    PetscCall(VecNorm(G, NORM_2, &fnorm));
    double phi = INFINITY;
    if (!PetscIsInfOrNanReal(fnorm)) {
      PetscCall(self.model().residual_norms(G, &now));
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

}  // namespace bs
