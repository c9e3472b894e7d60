#include <algorithm>
#include <cmath>
#include "solvers/newton/search/searches.hpp"

namespace bs {
namespace {

// phi = |(F_x/h, F_v)| / max(|F_x|/h, |F_v|) of the first iterate, where a part below its rounding errors counts as 0
double merit(const NewtonPolicy& self, const ResidualNorms& now) {
  const double kinematic = now[0] > self.floor()[0] ? self.solve().inverse_h * now[0] : 0;
  const double momentum = now[1] > self.floor()[1] ? now[1] : 0;
  const double size = self.solve().size_of_forces();
  return std::hypot(kinematic, momentum) / (size > 0 ? size : 1);
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
  for (int k = 0; k < TRIES && !found; ++k) {
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
