#include "solve/convergence.hpp"
#include <algorithm>

namespace bs {
namespace {

bool small(const ResidualNorms& now, const ResidualNorms& first, const ResidualNorms& floor, double rtol) {
  for (int k = 0; k < 2; ++k)
    if (now[k] > std::max(rtol * first[k], floor[k])) return false;
  return true;
}

// Converged: every part has fallen by rtol or below its rounding errors, or all of F below atol, or a whole Newton
// step below stol of the state. Diverged: not finite, or grown by the divergence tolerance.
PetscErrorCode test(SNES snes, PetscInt it, PetscReal xnorm, PetscReal snorm, PetscReal fnorm, SNESConvergedReason* reason,
                    void* context) {
  ConvergenceTest* self = static_cast<ConvergenceTest*>(context);
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
  PetscCall(self->model->residual_norms(F, &now));
  if (it == 0) self->first = now;
  const double total = std::max(self->first[0], self->first[1]);
  if (fnorm < atol) *reason = SNES_CONVERGED_FNORM_ABS;
  else if (small(now, self->first, self->floor, it > 0 ? rtol : 0.0)) *reason = SNES_CONVERGED_FNORM_RELATIVE;
  else if (it > 0 && snorm < stol * xnorm) *reason = SNES_CONVERGED_SNORM_RELATIVE;
  else if (it > 0 && divtol > 0 && fnorm > divtol * total && total > 0) *reason = SNES_DIVERGED_DTOL;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode ConvergenceTest::attach(SNES snes) {
  PetscFunctionBegin;
  PetscCall(SNESSetConvergenceTest(snes, test, this, nullptr));
  PetscFunctionReturn(0);
}

}  // namespace bs
