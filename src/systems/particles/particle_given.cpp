// What is given over time: whether a run can follow it.
#include <cmath>
#include "base/fault.hpp"
#include "base/shared_fault.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

PetscErrorCode ParticleModel::covers(double t_start, double t_end) {
  PetscFunctionBegin;
  if (net_.anchors_total > 0 && !motion_.covers(t_end))
    PetscCall(tell(net_.comm, Exit::input,
                   format("the table of -bs_anchor_table does not reach from t = 0 to the end of the run, "
                          "t = %g s: add rows or lower -ts_max_time",
                          t_end)));
  if (supports_.active()) PetscCall(supports_.covers(t_start, t_end));
  if (cell_.active()) PetscCall(cell_.covers(t_start, t_end));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::foresee(double from, double to, std::string* text) {
  Fault fault;
  PetscFunctionBegin;
  text->clear();
  if (!time_dependent()) PetscFunctionReturn(0);
  if (net_.anchors_total > 0) {
    double s[3], v[3];
    motion_.at(to, s, v);
    for (int c = 0; c < 3; ++c)
      if (!std::isfinite(s[c]) || !std::isfinite(v[c]))
        fault.note(-2, format("option -bs_anchor_motion: anchor points have no finite place or velocity at t = %.10g: give smaller numbers", to));
  }
  if (cell_.active()) cell_.foresee(from, to, &fault);
  supports_.foresee(from, to, &fault);
  PetscCall(shared_fault(net_.comm, fault, text));
  PetscFunctionReturn(0);
}

}  // namespace bs
