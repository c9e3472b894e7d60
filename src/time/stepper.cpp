// The hooks of TS, and what happens before a step; stepper_accept.cpp: after it.
#include "time/stepper.hpp"
#include <cmath>
#include <utility>
#include "base/error.hpp"
#include "time/methods.hpp"

namespace bs {

Stepper::Stepper(Model& model, TSContext& context, const StepOptions& options, OnStep on_step, OnFrame on_frame, OnFlush on_flush, OnSave on_save)
    : model_(model),
      context_(context),
      options_(options),
      on_step_(std::move(on_step)),
      on_frame_(std::move(on_frame)),
      on_flush_(std::move(on_flush)),
      on_save_(std::move(on_save)),
      rejections_(model) {}

PetscErrorCode Stepper::attach(TS ts) {
  TSAdapt adapt;
  bool adaptive = false;
  PetscReal start, end, nominal;
  PetscFunctionBegin;
  PetscCall(TSSetApplicationContext(ts, this));
  PetscCall(TSSetPreStep(ts, [](TS of_step) { return of(of_step).begin_step(of_step); }));
  PetscCall(TSSetPostStep(ts, [](TS of_step) { return of(of_step).accept_step(of_step); }));
  PetscCall(TSSetPreStage(ts, [](TS of_stage, PetscReal time) { return of(of_stage).before_stage(of_stage, time); }));
  PetscCall(TSSetPostStage(ts, [](TS of_stage, PetscReal time, PetscInt index, Vec* stages) {
    return of(of_stage).history_.record_stage(of_stage, time, stages[index]);
  }));
  PetscCall(rejections_.attach(ts, options_.length.least, options_.max_cuts));
  PetscCall(history_.attach(ts));
  context_.predictor.set_history(&history_);
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetScaleSolveFailed(adapt, options_.length.cut));
  PetscCall(is_adaptive(ts, &adaptive));
  PetscCall(TSGetTime(ts, &start));
  PetscCall(TSGetMaxTime(ts, &end));
  PetscCall(TSGetTimeStep(ts, &nominal));
  clock_ = OutputClock(start, end, options_.output_interval);
  length_ = StepLength(options_.length, nominal, adaptive, adaptive && context_.method->remembers(Memory::theta));
  schedule_ = WallSchedule(options_.save_minutes, options_.flush_seconds, MPI_Wtime());
  good_time_ = start;
  PetscCall(set_sides(ts));
  PetscCall(check_start(ts, start, length_.first_attempt()));
  PetscFunctionReturn(0);
}

// A method for which the end of a step counts alike in the steps on both sides keeps its order 2 where functions of time jump, if they have the mean
// of both sides there. Steps under error control end at such times, with the side to the left.
PetscErrorCode Stepper::set_sides(TS ts) {
  PetscReal theta;
  PetscFunctionBegin;
  PetscCall(theta_of(ts, &theta));
  const bool even = context_.method->is(TSBDF) || context_.method->is("verlet") || (context_.implicit && theta == 0.5);
  if (even && !length_.adaptive()) sides_.even_after = good_time_;
  model_.set_sides(sides_);
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::set_end(TS ts, double end) {
  PetscFunctionBegin;
  clock_.set_end(end);
  PetscCall(TSSetMaxTime(ts, end));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::attach_solvers(TS ts) {
  PetscFunctionBegin;
  PetscCall(reuse_.attach(ts, context_));
  PetscCall(rejections_.attach_solvers(ts, context_));
  PetscFunctionReturn(0);
}

Stepper& Stepper::of(TS ts) {
  void* self = nullptr;
  (void)TSGetApplicationContext(ts, &self);
  return *static_cast<Stepper*>(self);
}

PetscErrorCode Stepper::before_stage(TS ts, PetscReal time) {
  PetscFunctionBegin;
  const std::int64_t before = rejections_.in_a_row();
  if (!history_.replaying()) PetscCall(rejections_.before_stage(ts));
  if (rejections_.in_a_row() != before && !rejections_.gave_up()) PetscCall(begin_attempt(ts, rejections_.length(), history_.last_start()));
  PetscCall(context_.rosenbrock.before_stage(ts));
  history_.before_stage(time);
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::begin_step(TS ts) {
  PetscReal time;
  Vec y;
  PetscFunctionBegin;
  if (on_begin_) PetscCall(std::exchange(on_begin_, nullptr)());
  if (after_break_) {
    std::vector<NamedState> states;  // y is that of the history
    before_ = {};
    save(&before_, &states);
  }
  PetscCall(plan_length(ts));
  PetscCall(TSGetTime(ts, &time));
  if (options_.open) PetscCall(model_.covers(time, time + length_.planned()));
  rejections_.begin_step(time, length_.planned());
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(begin_attempt(ts, length_.planned(), y));
  // below the rounding errors of the residual no iteration can get
  if (context_.implicit) PetscCall(context_.newton.estimate_floor(1.0 / length_.planned()));
  PetscCall(reuse_.before_step(ts, history_.steps(), length_.planned()));
  PetscCall(history_.begin_step(ts));
  PetscFunctionReturn(0);
}

/// Of length h from y, where the model's forces may be others in every attempt.
PetscErrorCode Stepper::begin_attempt(TS ts, double h, Vec y) {
  PetscReal time;
  PetscInt step;
  PetscFunctionBegin;
  if (!model_.begins_steps()) PetscFunctionReturn(0);
  PetscCall(TSGetTime(ts, &time));
  PetscCall(TSGetStepNumber(ts, &step));
  PetscCall(model_.begin_step({time, h, step + 1, static_cast<PetscInt>(rejections_.in_a_row())}, y));
  PetscCall(renew_kept_forces(ts, time, y));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::plan_length(TS ts) {
  PetscReal time, proposed;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &time));
  PetscCall(TSGetTimeStep(ts, &proposed));
  const double output = clock_.next(time);
  // as far as a step of the proposed length may go, or two that share the way
  knot_ = length_.adaptive() ? model_.next_knot(time, std::min(output, time + 2 * std::max(proposed, options_.length.least))) : Knot{};
  if (knot_.is(output)) knot_.time = output;
  length_.plan(time, std::min(output, knot_.time), proposed, history_.steps() == 0);
  if (length_.shortened()) counter_.add_shortened();
  PetscCall(TSSetTimeStep(ts, length_.planned()));
  if (knot_.time > output || !length_.has_landed(time + length_.planned())) knot_ = {};
  else model_.set_sides({sides_.even_after, knot_.time, sides_.right_at});
  PetscFunctionReturn(0);
}

/// Collective. Ends the run with exit code 2 if it cannot go on from time t by a step of h, or can never reach its end.
PetscErrorCode Stepper::check_start(TS ts, double t, double h) {
  PetscReal end;
  PetscInt most;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(TSGetMaxTime(ts, &end));
  PetscCall(TSGetMaxSteps(ts, &most));
  PetscCall(is_adaptive(ts, &adaptive));
  // steps that an error estimate chooses grow, and a number of steps that was given ends the run before
  const bool counted = most < PETSC_MAX_INT, whole = !adaptive && !counted;
  std::string fault = lost_in_rounding(t, h, clock_.interval(), time_resolution(t));
  if (fault.empty() && whole) fault = lost_in_rounding(end, length_.nominal(), 0, time_resolution(end));
  if (fault.empty() && !counted) fault = lost_in_rounding(end, INFINITY, clock_.interval(), time_resolution(end));
  if (fault.empty() && whole) fault = endless((end - t) / length_.nominal());
  if (fault.empty() && t < end) {
    PetscCall(model_.foresee(t, t, &fault));
    if (fault.empty()) PetscCall(model_.foresee(t, std::min(t + h, clock_.next(t)), &fault));
  }
  if (!fault.empty()) PetscCall(fail(model_.comm(), Exit::input, fault));
  PetscFunctionReturn(0);
}

/// Whether what is given over time can be followed through the next step.
PetscErrorCode Stepper::foresee_next(double time, std::string* fault) {
  return model_.foresee(time, std::min(time + length_.next(), clock_.next(time)), fault);
}

}  // namespace bs
