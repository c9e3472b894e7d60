// After a step: whether it is good, what is kept of it, and what follows.
#include <cmath>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/vec_array.hpp"
#include "systems/system.hpp"
#include "time/methods.hpp"
#include "time/stepper.hpp"

namespace bs {

PetscErrorCode Stepper::accept_step(TS ts) {
  StepRecord record;
  bool good = false, landed = false, counts = true;
  PetscFunctionBegin;
  PetscCall(count_step(ts, &record));
  PetscCall(is_good(ts, &good));
  if (!good) PetscFunctionReturn(0);
  PetscCall(keep_step(ts, &record, &landed, &counts));
  if (!counts) {
    PetscCall(undo_step(ts));
    PetscCall(decide_what_follows(ts, good_time_, false));
    PetscFunctionReturn(0);
  }
  const bool finished = landed && clock_.is_end(record.time);
  PetscCall(on_step_(record));  // with what was given during the step
  if (knot_.time == record.time) PetscCall(leave_knot(ts, record.time));
  PetscCall(write_frame_if_due(ts, record, landed));
  if (now_.flush_due) PetscCall(on_flush_());
  if (landed) clock_.pass(record.time);
  PetscCall(decide_what_follows(ts, record.time, finished));
  PetscCall(save_if_due(record.step, finished));
  PetscFunctionReturn(0);
}

/// Iterations and rejections of the step, good or not.
PetscErrorCode Stepper::count_step(TS ts, StepRecord* record) {
  PetscFunctionBegin;
  PetscCall(rejections_.end_step(ts));
  PetscCall(count_iterations(ts, record));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::count_start(TS ts) {
  StepRecord start;
  PetscFunctionBegin;
  PetscCall(count_iterations(ts, &start));
  PetscFunctionReturn(0);
}

/// What is new since the last count is added to the step's.
PetscErrorCode Stepper::count_iterations(TS ts, StepRecord* record) {
  StepRecord more;
  PetscInt newton, krylov;
  PetscFunctionBegin;
  PetscCall(TSGetSNESIterations(ts, &newton));
  PetscCall(krylov_iterations(ts, context_.implicit, &krylov));
  counter_.count(newton, krylov, rejections_.counts(), &more);
  record->newton += more.newton;
  record->krylov += more.krylov;
  record->rejected += more.rejected;
  for (std::size_t k = 0; k < more.reasons.size(); ++k) record->reasons[k] += more.reasons[k];
  PetscFunctionReturn(0);
}

/// Whether TS has made the step, to a state that is finite everywhere, under what can be followed; if not, the last good state comes back.
PetscErrorCode Stepper::is_good(TS ts, bool* good) {
  TSConvergedReason reason;
  PetscReal time;
  PetscFunctionBegin;
  *good = false;
  PetscCall(TSGetConvergedReason(ts, &reason));
  if (reason < 0) PetscFunctionReturn(0);
  PetscCall(reduce_verdict(ts));
  PetscCall(TSGetTime(ts, &time));
  if (now_.finite) PetscCall(model_.foresee(good_time_, time, &ending_));
  *good = now_.finite && ending_.empty();
  if (*good) PetscFunctionReturn(0);
  // a type that cannot cut its step has overwritten it
  PetscCall(return_to_good(ts));
  if (!now_.finite) trouble_ = "the state overflowed";
  PetscCall(TSSetConvergedReason(ts, TS_DIVERGED_STEP_REJECTED));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::return_to_good(TS ts) {
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  if (history_.in_step() && history_.last_start()) PetscCall(VecCopy(history_.last_start(), y));
  PetscFunctionReturn(0);
}

/// One reduction a step: is the state finite everywhere, and has a signal come, is a checkpoint due, or a flush?
PetscErrorCode Stepper::reduce_verdict(TS ts) {
  Vec y;
  PetscInt n = 0;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecGetLocalSize(y, &n));
  const ReadArray ay(y);
  // a sum is finite only if its terms are: no branch in the loop. Squares that overflow have no energy
  double sum = 0;
  for (PetscInt i = 0; i < n; ++i) sum += 0.0 * (ay[i] * ay[i]);
  const bool late = schedule_.save_due(MPI_Wtime()), asked = late || checkpoint_is_asked(model_.comm());
  int flags[4] = {std::isfinite(sum) ? 0 : 1, ending_signal(model_.comm()), asked ? 1 : 0, schedule_.flush_due(MPI_Wtime()) ? 1 : 0};
  PetscCall(max_over_ranks(model_.comm(), flags, 4));
  now_ = {flags[0] == 0, flags[1], flags[2] != 0, flags[3] != 0};
  if (now_.flush_due) schedule_.flushed(MPI_Wtime());
  PetscFunctionReturn(0);
}

/// The step counts from here on, unless what broke at its end finds no rest; its time, where it has landed, is the output time itself. TS gets the
/// length of the next one.
PetscErrorCode Stepper::keep_step(TS ts, StepRecord* record, bool* landed, bool* counts) {
  PetscInt steps;
  PetscReal time, before, proposed;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(ts, &steps));
  PetscCall(TSGetTime(ts, &time));
  PetscCall(TSGetPrevTime(ts, &before));
  PetscCall(TSGetTimeStep(ts, &proposed));
  const double taken = time - before;
  const bool at_target = length_.has_landed(time);
  time = length_.end_of_step(time, clock_.previous());
  *landed = at_target && time >= clock_.next(time);
  PetscCall(TSSetTime(ts, time));
  length_.follow(taken, at_target, record->rejected > 0, proposed);
  PetscCall(TSSetTimeStep(ts, length_.next()));
  counter_.set_steps(steps);
  record->step = steps;
  record->time = good_time_ = time;
  record->dt = length_.recorded(taken);
  PetscCall(TSGetSolution(ts, &y));
  if (after_break_) model_.breaks()->mark();
  PetscCall(model_.accept({time, taken, steps, static_cast<PetscInt>(record->rejected)}, y));
  if (!context_.implicit && model_.remembers())
    PetscCall(TSRestartStep(ts));  // a last stage that would be the next step's first is of forces before that
  if (model_.breaks() && model_.breaks()->broke() > 0) PetscCall(after_break(ts, y, record, counts));
  if (!*counts) PetscFunctionReturn(0);
  framed_ = false;
  PetscCall(history_.end_step(ts));
  PetscFunctionReturn(0);
}

/// What is given over time has its values to the right from here on; a method that takes the end of its step for the next one's start evaluates it
/// again. After a jump it goes on as at the start of a run: steps before tell nothing of those that follow.
PetscErrorCode Stepper::leave_knot(TS ts, double time) {
  PetscFunctionBegin;
  sides_.right_at = time;
  model_.set_sides(sides_);
  if (knot_.jumps || context_.method->remembers(Memory::none)) PetscCall(TSRestartStep(ts));
  if (!knot_.jumps) PetscFunctionReturn(0);
  length_.begin_anew();
  PetscCall(TSSetTimeStep(ts, length_.next()));
  history_.forget();
  PetscFunctionReturn(0);
}

/// Forces are others from here on: what a method keeps of them is evaluated again.
PetscErrorCode Stepper::after_break(TS ts, Vec y, StepRecord* record, bool* counts) {
  const double time = record->time;
  PetscFunctionBegin;
  const auto frame = [&](Vec between) { return on_frame_(static_cast<PetscInt>(counter_.counts().steps), time, between); };
  if (after_break_) {
    PetscCall(after_break_(time, y, frame, counts, &give_up_reason_));
    PetscCall(count_iterations(ts, record));
    int signal = std::max(now_.signal, ending_signal(model_.comm()));
    PetscCallMPI(MPI_Allreduce(&signal, &now_.signal, 1, MPI_INT, MPI_MAX, model_.comm()));
  }
  PetscCall(renew_kept_forces(ts, time, y));
  PetscFunctionReturn(0);
}

/// What the method keeps of the forces at y, which are others than when it computed them.
PetscErrorCode Stepper::renew_kept_forces(TS ts, double time, Vec y) {
  KeptAcceleration* own;
  PetscFunctionBegin;
  if (context_.method->remembers(Memory::acceleration)) {
    PetscCall(kept_acceleration(ts, &own));
    if (own->known) PetscCall(model_.rhs(time, y, own->kept));
  } else if (!context_.implicit) {
    PetscCall(TSRestartStep(ts));  // types whose last stage is the next step's first
  }
  PetscFunctionReturn(0);
}

/// Everything is as before the step, as if its end was never reached: a run that is continued makes it again.
PetscErrorCode Stepper::undo_step(TS ts) {
  std::string changed;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(VecCopy(history_.last_start(), y));
  model_.breaks()->revert();
  model_.restore_sums(before_.real);
  PetscCall(stand_at(ts, before_, &changed));
  PetscCall(restore_counts(ts, before_));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::write_frame_if_due(TS ts, const StepRecord& record, bool landed) {
  Vec y;
  PetscFunctionBegin;
  if (!landed && !options_.every_step) PetscFunctionReturn(0);
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(on_frame_(static_cast<PetscInt>(record.step), record.time, y));
  framed_ = true;
  PetscFunctionReturn(0);
}

/// Whether TSSolve goes on.
PetscErrorCode Stepper::decide_what_follows(TS ts, double time, bool finished) {
  PetscFunctionBegin;
  ending_ = !give_up_reason_.empty() ? give_up_reason_
            : finished               ? ""
                                     : lost_in_rounding(time, length_.next(), clock_.interval(), time_rounding(time));
  if (ending_.empty() && !finished && !now_.signal) PetscCall(foresee_next(time, &ending_));
  if (finished && give_up_reason_.empty()) PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_TIME));
  else if (!ending_.empty()) PetscCall(TSSetConvergedReason(ts, TS_DIVERGED_STEP_REJECTED));
  else if (now_.signal) PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_USER));
  PetscFunctionReturn(0);
}

/// A checkpoint by the count of steps, the wall clock or a signal; the end, and a signal that ends the run, have one of their own.
PetscErrorCode Stepper::save_if_due(std::int64_t step, bool finished) {
  PetscFunctionBegin;
  const bool by_count = options_.save_every > 0 && step % options_.save_every == 0;
  if (!(by_count || now_.save_due) || finished || now_.signal) PetscFunctionReturn(0);
  PetscCall(on_save_());
  schedule_.saved(MPI_Wtime());
  PetscFunctionReturn(0);
}

}  // namespace bs
