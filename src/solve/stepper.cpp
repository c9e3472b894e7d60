#include "solve/stepper.hpp"
#include <algorithm>
#include <cmath>
#include "solve/ts_queries.hpp"

namespace bs {
namespace {

constexpr double SAME = SAME_STEP;
// Length of a step without error estimate, of the nominal one.
constexpr double BLIND = 1e-3;

}  // namespace

Stepper::Stepper(Model& model, TSContext& context, const StepOptions& options, OnStep on_step, OnFrame on_frame, OnSave on_save)
    : model_(model), context_(context), options_(options), on_step_(std::move(on_step)), on_frame_(std::move(on_frame)),
      on_save_(std::move(on_save)), rejections_(model) {}

PetscErrorCode Stepper::attach(TS ts) {
  TSAdapt adapt;
  bool theta = false;
  PetscFunctionBegin;
  PetscCall(TSSetApplicationContext(ts, this));
  PetscCall(TSSetPreStep(ts, pre_step));
  PetscCall(TSSetPostStep(ts, post_step));
  PetscCall(TSSetPreStage(ts, pre_stage));
  PetscCall(TSSetPostStage(ts, post_stage));
  PetscCall(rejections_.attach(ts, options_.step_min, options_.max_cuts));
  PetscCall(history_.attach(ts));
  context_.predictor.set_history(&history_);
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(is_adaptive(ts, &adaptive_));
  PetscCall(TSAdaptSetScaleSolveFailed(adapt, options_.cut));
  PetscCall(is_theta_family(ts, &theta));
  blind_ = adaptive_ && theta;
  PetscBool alpha = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ts), TSALPHA, &alpha));
  alpha_ = alpha;
  PetscCall(TSGetTime(ts, &start_));
  PetscCall(TSGetMaxTime(ts, &end_));
  PetscCall(TSGetTimeStep(ts, &nominal_));
  good_time_ = start_;
  saved_ = next_ = nominal_;
  saved_at_ = logged_at_ = MPI_Wtime();
  PetscCall(tell_lost_steps(start_, options_.first > 0 ? std::min(options_.first, nominal_) : blind_ ? BLIND * nominal_ : nominal_));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::attach_solvers(TS ts) {
  PetscFunctionBegin;
  PetscCall(reuse_.attach(ts, context_));
  PetscCall(rejections_.attach_solvers(ts, context_));
  PetscFunctionReturn(0);
}

/// Output times are start + k*interval, and the end of the run.
double Stepper::next_output(double time) const {
  const double dt = options_.output_interval;
  if (dt <= 0) return end_;
  double next = start_ + static_cast<double>(frame_) * dt;
  // k*dt may lie a rounding error before the end
  if (next > end_ || std::abs(next - end_) <= SAME * dt) next = end_;
  return std::max(next, time);
}

PetscErrorCode Stepper::pre_step(TS ts) {
  void* context = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &context));
  Stepper* self = static_cast<Stepper*>(context);
  PetscCall(self->choose_step(ts));
  PetscReal time;
  PetscCall(TSGetTime(ts, &time));
  self->rejections_.begin_step(time, self->planned_, self->again_);
  self->again_ = false;
  // PETSc's alpha forgets the cut where its starting procedure fails: that step comes back after every rejection
  const bool own = self->alpha_ && self->history_.steps() == 0;
  if (own != self->own_start_) PetscCall(TSSetMaxStepRejections(ts, own ? 0 : -1));
  self->own_start_ = own;
  // below the rounding errors of the residual no iteration can get
  if (self->context_.implicit) PetscCall(self->context_.newton.estimate_floor(1.0 / self->planned_));
  PetscInt step;
  PetscCall(TSGetStepNumber(ts, &step));
  PetscCall(self->reuse_.before_step(ts, step, self->planned_));
  PetscCall(self->history_.begin_step(ts));
  if (self->first_ == 0) self->first_ = self->planned_;
  PetscFunctionReturn(0);
}

// Lands on the next output time: the step that would pass it is shortened, one that misses it by rounding kept.
PetscErrorCode Stepper::choose_step(TS ts) {
  PetscReal time, h;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &time));
  PetscCall(TSGetTimeStep(ts, &h));
  // the estimate of the theta family needs a step before: without one it starts where nothing can go wrong unseen
  if (history_.steps() == 0 && (blind_ || options_.first > 0)) h = std::min(h, options_.first > 0 ? options_.first : BLIND * nominal_);
  else if (adaptive_) h = std::max(h, options_.step_min);
  target_ = next_output(time);
  const double rest = target_ - time;
  saved_ = h;
  planned_ = h;
  const double slack = time_rounding(target_);
  landing_ = h >= rest * (1 - SAME) - slack;
  if (landing_ && h > rest * (1 + SAME) + slack) planned_ = rest;
  // two middling steps rather than a full one and a sliver, where the step is free
  else if (adaptive_ && !landing_ && h > 0.5 * rest * (1 + SAME)) planned_ = 0.5 * rest;
  if (landing_ && planned_ < nominal_ * (1 - SAME) && !adaptive_ && saved_ >= nominal_ * (1 - SAME)) ++counts_.shortened;
  PetscCall(TSSetTimeStep(ts, planned_));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::post_step(TS ts) {
  void* context = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &context));
  PetscCall(static_cast<Stepper*>(context)->accept_step(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::pre_stage(TS ts, PetscReal) {
  void* context = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &context));
  Stepper* self = static_cast<Stepper*>(context);
  if (!self->history_.replaying()) PetscCall(self->rejections_.before_stage(ts));
  PetscCall(self->context_.rosenbrock.before_stage(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::post_stage(TS ts, PetscReal time, PetscInt index, Vec* stages) {
  void* context = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &context));
  PetscCall(static_cast<Stepper*>(context)->history_.see_stage(ts, time, stages[index]));
  PetscFunctionReturn(0);
}

// After a landing the step before it comes back; after cuts it grows back by 1/cut every few good steps.
void Stepper::restore_step(bool landed, double taken, double* next) {
  if (adaptive_) {
    if (landed && taken < saved_) *next = std::max(*next, saved_);
    return;
  }
  *next = saved_;
  if (taken < planned_ * (1 - SAME)) *next = taken;
  if (*next >= nominal_ * (1 - SAME)) {
    *next = nominal_;
  } else if (++good_in_a_row_ >= options_.grow_after) {
    *next = std::min(nominal_, *next / options_.cut);
    good_in_a_row_ = 0;
  }
}

PetscErrorCode Stepper::accept_step(TS ts) {
  TSConvergedReason reason;
  PetscReal time, next, before;
  bool finite = true;
  PetscFunctionBegin;
  StepRecord record;
  PetscInt steps, newton, krylov;
  bool again = false;
  PetscCall(repeat_start(ts, &again));
  if (again) PetscFunctionReturn(0);
  PetscCall(TSGetConvergedReason(ts, &reason));
  PetscCall(TSGetStepNumber(ts, &steps));
  PetscCall(TSGetSNESIterations(ts, &newton));
  PetscCall(krylov_iterations(ts, &krylov));
  newton += base_.newton;
  krylov += base_.krylov;
  PetscCall(rejections_.end_step(ts));
  for (std::size_t k = 0; k < record.reasons.size(); ++k) record.reasons[k] = rejections_.counts()[k] - rejected_before_[k];
  rejected_before_ = rejections_.counts();
  const PetscInt rejected = static_cast<PetscInt>(total(rejected_before_));
  record.newton = newton - counts_.newton;
  record.krylov = krylov - counts_.krylov;
  record.rejected = rejected - counts_.rejected;
  counts_.newton = newton;
  counts_.krylov = krylov;
  counts_.rejected = rejected;
  if (reason < 0) PetscFunctionReturn(0);
  PetscCall(check_state(ts, &finite));
  if (!finite) {
    // the last good state comes back: a type that cannot cut its step has overwritten it
    Vec y;
    PetscCall(TSGetSolution(ts, &y));
    PetscCall(VecCopy(history_.last_start(), y));
    trouble_ = "the state overflowed";
    PetscCall(TSSetConvergedReason(ts, TS_DIVERGED_STEP_REJECTED));
    PetscFunctionReturn(0);
  }
  counts_.steps = steps;
  PetscCall(TSGetTime(ts, &time));
  PetscCall(TSGetPrevTime(ts, &before));
  const double taken = time - before;
  const bool rejected_now = record.rejected > 0;
  if (rejected_now) good_in_a_row_ = 0;
  const bool landed = landing_ && std::abs(time - target_) <= std::max(SAME * planned_, time_rounding(target_));
  if (landed) {
    time = target_;
    PetscCall(TSSetTime(ts, time));
  }
  PetscCall(TSGetTimeStep(ts, &next));
  restore_step(landed, taken, &next);
  PetscCall(TSSetTimeStep(ts, next));
  next_ = next;
  record.step = steps;
  record.time = time;
  record.dt = std::abs(taken - planned_) <= SAME * planned_ ? planned_ : taken;
  good_time_ = time;
  framed_ = false;
  Vec y;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(history_.end_step(ts, y));
  PetscCall(model_.accept(time, y));
  PetscCall(on_step_(record));
  const bool finished = landed && target_ >= end_;
  if (landed || options_.every_step) {
    PetscCall(on_frame_(steps, time, y));
    framed_ = true;
  }
  if (landed) ++frame_;
  ending_ = finished ? "" : lost_steps(time, next, time_rounding(time));
  if (finished) PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_TIME));
  else if (!ending_.empty()) PetscCall(TSSetConvergedReason(ts, TS_DIVERGED_STEP_REJECTED));
  else if (signal_) PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_USER));
  // the end and a signal have a checkpoint of their own
  const bool by_count = options_.save_every > 0 && steps % options_.save_every == 0;
  if ((by_count || save_due_) && !finished && !signal_) {
    PetscCall(on_save_());
    saved_at_ = MPI_Wtime();
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
