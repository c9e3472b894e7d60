// What stepping asks before and after a step: what the solvers did, whether the state is good.
#include <cmath>
#include "base/fault.hpp"
#include "solve/condensed/condensed.hpp"
#include "solve/signals.hpp"
#include "solve/stepper.hpp"
#include "solve/ts_queries.hpp"

namespace bs {

/// What to say where steps of h, or output times, are shorter than the `least` that counts beside t; empty where they are not.
std::string Stepper::lost_steps(double t, double h, double least) const {
  const double interval = options_.output_interval;
  if (h >= least && (interval <= 0 || interval >= least)) return {};
  const bool step = h < least;
  return format("%s %g s is lost in the rounding of t = %.10g s, beside which %g s is the least that counts: ",
                step ? "a step of" : "option -bs_output_interval:", step ? h : interval, t, least) +
         "let the clock start at 0 (-ts_init_time), or give a larger one";
}

/// Collective. Told (exit 2) where the run cannot go on from time t by a step of h.
PetscErrorCode Stepper::tell_lost_steps(double t, double h) const {
  PetscFunctionBegin;
  const std::string fault = lost_steps(t, h, time_resolution(t));
  if (!fault.empty()) PetscCall(tell(model_.comm(), Exit::input, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::repeat_start(TS ts, bool* again) {
  TSConvergedReason reason;
  PetscFunctionBegin;
  *again = false;
  PetscCall(TSGetConvergedReason(ts, &reason));
  if (!own_start_ || reason != TS_DIVERGED_STEP_REJECTED) PetscFunctionReturn(0);
  PetscCall(rejections_.try_again(ts, options_.cut, again));
  again_ = *again;
  if (*again) PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_ITERATING));
  PetscFunctionReturn(0);
}

/// Iterations on the linear systems; of a condensed solve those inside it.
PetscErrorCode Stepper::krylov_iterations(TS ts, PetscInt* count) {
  PC pc;
  CondensedCounts inner;
  bool condensed = false;
  PetscFunctionBegin;
  PetscCall(TSGetKSPIterations(ts, count));
  if (!context_.implicit) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_counts(pc, &condensed, &inner));
  if (condensed) *count = inner.iterations;
  PetscFunctionReturn(0);
}

/// One reduction a step: is the state finite everywhere, and has a signal come, is a checkpoint due, or the log?
PetscErrorCode Stepper::check_state(TS ts, bool* finite) {
  Vec y;
  const PetscScalar* ay = nullptr;
  PetscInt n = 0;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecGetLocalSize(y, &n));
  PetscCall(VecGetArrayRead(y, &ay));
  // a sum is finite only if its terms are: no branch in the loop
  double sum = 0;
  for (PetscInt i = 0; i < n; ++i) sum += 0.0 * ay[i];
  PetscCall(VecRestoreArrayRead(y, &ay));
  const bool late = options_.save_minutes > 0 && MPI_Wtime() - saved_at_ >= 60 * options_.save_minutes;
  constexpr double LOG_SECONDS = 10;
  int flags[4] = {std::isfinite(sum) ? 0 : 1, ending_signal(), late || take_checkpoint_signal() ? 1 : 0,
                  MPI_Wtime() - logged_at_ >= LOG_SECONDS ? 1 : 0};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, flags, 4, MPI_INT, MPI_MAX, model_.comm()));
  *finite = flags[0] == 0;
  signal_ = flags[1];
  save_due_ = flags[2] != 0;
  log_due_ = flags[3] != 0;
  if (log_due_) logged_at_ = MPI_Wtime();
  PetscFunctionReturn(0);
}

}  // namespace bs
