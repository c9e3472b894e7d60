#include "tasks/step_watch.hpp"
#include "base/fault.hpp"
#include "time/ts_queries.hpp"

namespace bs {

PetscErrorCode StepWatch::begin(TS ts, const TSContext& context, const Advice& start) {
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(is_adaptive(ts, &adaptive));
  if (context.implicit || adaptive || !model_.mechanics() || context.method->traits->oscillation <= 0) PetscFunctionReturn(0);
  step_ = start.step;
  if (step_ <= largest_stable_step(*context.method, start.spectrum.omega_max, start.spectrum.damping)) method_ = context.method;
  PetscFunctionReturn(0);
}

PetscErrorCode StepWatch::look(PetscInt step, double t, Vec y) {
  constexpr PetscInt RARELY = 512;
  constexpr double OVER = 1.001;  // the estimate is by differences of forces
  const char* const key = "step_limit";
  Spectrum now;
  PetscFunctionBegin;
  const bool power = step > 0 && (step & (step - 1)) == 0;
  if (!method_ || warnings_.has(key) || !(step < RARELY ? power : step % RARELY == 0)) PetscFunctionReturn(0);
  PetscCall(estimate_spectrum(*model_.mechanics(), t, y, &now));
  const double most = largest_stable_step(*method_, now.omega_ritz, now.damping);
  if (!(most > 0) || step_ <= OVER * most) PetscFunctionReturn(0);
  PetscCall(warnings_.add(key, format("the step %g s is beyond the stability limit of -ts_type %s since step %lld at the latest, t = %.6g s: the "
                                      "fastest oscillation is at %.3g 1/s there; "
                                      "lower -ts_dt below %.3g s, or take an implicit type such as beuler",
                                      step_, method_->type(), static_cast<long long>(step), t, now.omega_ritz, most)));
  PetscFunctionReturn(0);
}

}  // namespace bs
