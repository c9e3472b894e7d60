#include "tasks/run.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "output/tables.hpp"
#include "systems/mechanics.hpp"
#include "systems/system.hpp"
#include "time/disown.hpp"

namespace bs {

/// The stepper may be handed out.
Run::~Run() {
  if (ts_) (void)disown(ts_);
}

RunState Run::state() const {
  const RunCounts& c = stepper_->counts();
  return {stepper_->good_time(),
          start_,
          end_,
          c.steps,
          c.rejected,
          c.newton,
          c.krylov,
          total_energy(last_),
          observed_,
          in_words(stepper_->rejections().counts()),
          static_cast<std::int64_t>(warnings_.keys().size()),
          hooks_.loads ? hooks_.clock : nullptr};
}

PetscErrorCode Run::on_step(const StepRecord& record) {
  PetscFunctionBegin;
  constexpr int MOST_ROWS = 4096;  // of the log that are held in memory: half a megabyte
  Vec y;
  if (trajectory_) trajectory_->log_step(record);
  if (trajectory_ && ++held_rows_ >= MOST_ROWS) {
    set_phase(model_.comm(), Exit::io);
    PetscCall(trajectory_->write_waiting());
    set_phase(model_.comm(), Exit::solve);
    held_rows_ = 0;
  }
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(watch_.check(static_cast<PetscInt>(record.step), record.time, y, false));
  PetscCall(step_watch_.check(static_cast<PetscInt>(record.step), record.time, y));
  progress_.update(state());
  if (options_.rest > 0) PetscCall(end_at_rest(record.time, y));
  if (hooks_.on_step) hooks_.on_step(record);
  if (record.step == pause_at_) PetscCall(pause());
  if (hooks_.done && hooks_.done()) PetscCall(pause());
  if (hooks_.after_break) PetscCall(facts(&good_facts_));
  PetscFunctionReturn(0);
}

/// Both must have fallen: what swings has no velocity at one moment and no force at another.
PetscErrorCode Run::end_at_rest(double time, Vec y) {
  Mechanics* mechanics = model_.mechanics();
  const PetscScalar* a = nullptr;
  const double* f = nullptr;
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  const Layout at = mechanics->layout();
  const std::vector<double>& masses = mechanics->masses();
  PetscCall(mechanics->force(time, y, &f));
  PetscCall(VecGetArrayRead(y, &a));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      sums[0] += f[i * at.dim + c] * f[i * at.dim + c];
      sums[1] += masses[static_cast<std::size_t>(i)] * a[at.v(i, c)] * a[at.v(i, c)];
    }
  PetscCall(VecRestoreArrayRead(y, &a));
  PetscCall(sum_over_ranks(model_.comm(), sums, 2));
  most_force_ = std::max(most_force_, std::sqrt(sums[0]));
  most_speed_ = std::max(most_speed_, std::sqrt(sums[1]));
  const bool moved = most_force_ > 0 || most_speed_ > 0;  // else it waits for a load
  rests_ = moved && std::sqrt(sums[0]) <= options_.rest * most_force_ && std::sqrt(sums[1]) <= options_.rest * most_speed_;
  if (rests_) PetscCall(pause());
  PetscFunctionReturn(0);
}

PetscErrorCode Run::observe(double time, Vec y) {
  PetscFunctionBegin;
  observed_ = time;
  PetscCall(model_.observe(time, y, &last_));
  if (hooks_.observe) PetscCall(hooks_.observe(time, y, &last_));
  PetscFunctionReturn(0);
}

/// The trajectory that goes on can take the frames of this run, or the run ends here, before the first step.
PetscErrorCode Run::require_form(Vec y) {
  std::vector<Field> fields;
  PetscFunctionBegin;
  PetscCall(model_.fields(stepper_->good_time(), y, &fields));
  PetscCall(trajectory_->require_form(fields, last_, changed_form_));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::on_frame(PetscInt step, double time, Vec y) {
  const std::vector<Observable> before = last_;
  std::vector<Field> fields;
  std::string what;
  PetscFunctionBegin;
  PetscCall(observe(time, y));
  if (trajectory_) PetscCall(model_.fields(time, y, &fields));
  PetscCall(find_not_finite(model_.comm(), fields, last_, &what));
  if (!what.empty()) {
    PetscCall(give_up_frame(time, what, before));
    PetscFunctionReturn(0);
  }
  PetscCall(watch_.check(step, time, y, true));
  PetscCall(tolerance_watch_.check(ts_, y));
  if (first_.empty()) first_ = last_;
  if (trajectory_) {
    set_phase(model_.comm(), Exit::io);
    const Breaks* breaks = hooks_.loads ? model_.breaks() : nullptr;
    const bool behind = abandoned_.shown && !relaxing_;
    PetscCall(trajectory_->write_frame(step + (breaks ? breaks->motion_steps() : 0) + (behind ? abandoned_.steps : 0),
                                       shown_time(time) + (behind ? abandoned_.time : 0), fields, last_));
    set_phase(model_.comm(), Exit::solve);
  }
  if (hooks_.on_frame) hooks_.on_frame(time);
  if (hooks_.after_break && !relaxing_) PetscCall(facts(&good_facts_));
  PetscFunctionReturn(0);
}

/// A frame that is not finite is not written: the run does not begin, or ends with those before it.
PetscErrorCode Run::give_up_frame(double time, const std::string& what, const std::vector<Observable>& before) {
  PetscFunctionBegin;
  std::string fault;
  PetscCall(model_.last_fault(&fault));
  const std::string place = format("%s at %s = %.10g: ", what.c_str(), hooks_.loads ? hooks_.clock : "t", time);
  if (first_.empty() && !resumed_)
    PetscCall(fail(model_.comm(), Exit::input, "the state at the start is not finite: " + place + (fault.empty() ? "give smaller numbers" : fault)));
  spoiled_ = true;
  last_ = before;
  stepper_->give_up("the state is not finite any more: " + place + (fault.empty() ? "try a smaller step" : fault) + "; earlier frames are intact");
  PetscFunctionReturn(0);
}

/// Of statics with motions at constant load: time has passed in them.
double Run::shown_time(double time) const { return time + (hooks_.loads && model_.breaks() ? model_.breaks()->motion() : 0); }

PetscErrorCode Run::on_flush() {
  PetscFunctionBegin;
  if (!trajectory_) PetscFunctionReturn(0);
  set_phase(model_.comm(), Exit::io);
  PetscCall(trajectory_->flush());
  set_phase(model_.comm(), Exit::solve);
  held_rows_ = 0;
  PetscFunctionReturn(0);
}

/// What broke comes to rest, by the task. Where the step is taken back, frames of the motion stay in the file, in front of one of the last good
/// state; a checkpoint knows nothing of them.
PetscErrorCode Run::after_break(double time, Vec y, const std::function<PetscErrorCode(Vec)>& frame, bool* found, std::string* failure) {
  const Breaks& breaks = *model_.breaks();
  const double motion = breaks.motion(), good = good_facts_.real.at("time");
  const std::int64_t steps = breaks.motion_steps();
  const auto between = [&](Vec moving) {
    PetscFunctionBegin;
    if (trajectory_ && !abandoned_.shown) PetscCall(flushed_mark(trajectory_.get(), &abandoned_.before));
    abandoned_.shown = trajectory_ != nullptr;
    PetscCall(frame(moving));
    PetscFunctionReturn(0);
  };
  PetscFunctionBegin;
  abandoned_ = {};
  relaxing_ = true;
  PetscCall(hooks_.after_break(time, y, between, found, failure));
  relaxing_ = false;
  if (*found) abandoned_ = {};
  abandoned_.time = time - good + breaks.motion() - motion;
  abandoned_.steps = 1 + breaks.motion_steps() - steps;
  PetscFunctionReturn(0);
}

PetscErrorCode Run::advance(int* exit_code) {
  PetscFunctionBegin;
  *exit_code = 0;
  if (is_given("-help")) PetscFunctionReturn(0);
  PetscCall(begin());
  PetscCall(go_on());
  PetscCall(end(exit_code));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::begin() {
  Vec y;
  PetscInt first_step;
  PetscFunctionBegin;
  PetscCall(remove_earlier_results(model_.comm()));
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(TSGetStepNumber(ts_, &first_step));
  PetscCall(tolerance_watch_.begin(ts_));
  set_phase(model_.comm(), Exit::solve);
  if (resumed_) {
    PetscCall(observe(stepper_->good_time(), y));
    PetscCall(require_form(y));
    PetscCall(watch_.check(first_step, stepper_->good_time(), y, true));
  } else {
    PetscCall(on_frame(first_step, stepper_->good_time(), y));
  }
  if (first_.empty()) first_ = last_;
  if (steps_at_restart_ <= 0 && hooks_.begin)
    stepper_->set_on_begin([this] {
      PetscFunctionBegin;
      PetscCall(hooks_.begin());
      PetscCall(stepper_->count_start(ts_));
      PetscCall(facts(&good_facts_));
      PetscFunctionReturn(0);
    });
  restore_facts();
  PetscCall(facts(&good_facts_));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::go_on(std::int64_t steps) {
  PetscFunctionBegin;
  pause_at_ = steps < 0 ? -1 : this->steps() + steps;
  PetscCall(TSSolve(ts_, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::count_earlier(std::int64_t steps) {
  PetscInt most;
  PetscFunctionBegin;
  earlier_steps_ = steps;
  PetscCall(TSGetMaxSteps(ts_, &most));
  if (most < PETSC_MAX_INT) PetscCall(TSSetMaxSteps(ts_, static_cast<PetscInt>(std::max<std::int64_t>(most - steps, 0))));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::out_of_steps(bool* yes) {
  PetscInt taken, most;
  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(ts_, &taken));
  PetscCall(TSGetMaxSteps(ts_, &most));
  *yes = taken >= most;
  if (*yes && !at_end()) PetscCall(warn_of_early_end());
  PetscFunctionReturn(0);
}

PetscErrorCode Run::trouble(std::string* why) {
  TSConvergedReason reason;
  PetscFunctionBegin;
  why->clear();
  PetscCall(TSGetConvergedReason(ts_, &reason));
  if (reason < 0) PetscCall(explain(reason, why));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::end(int* exit_code) {
  TSConvergedReason reason;
  PetscFunctionBegin;
  PetscCall(TSGetConvergedReason(ts_, &reason));
  PetscCall(save_last(reason < 0));
  PetscCall(conclude(reason, exit_code));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::set_end(double time) {
  PetscFunctionBegin;
  PetscCall(model_.covers(start_, time));
  end_ = time;
  PetscCall(stepper_->set_end(ts_, time));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::leave_open() {
  PetscFunctionBegin;
  end_ = far_from(stepper_->good_time(), stepper_->nominal_step());
  PetscCall(stepper_->set_end(ts_, end_));
  PetscFunctionReturn(0);
}

}  // namespace bs
