// A run before its first step: checkpoint, TS, header, solvers, trajectory.
#include <unistd.h>
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "base/recalled_options.hpp"
#include "base/rounding.hpp"
#include "base/text.hpp"
#include "tasks/matrices.hpp"
#include "tasks/run.hpp"
#include "tasks/unused_options.hpp"
#include "time/implicit/solver_setup.hpp"

namespace bs {
namespace {

/// A continued run begins where the checkpoint was written.
PetscErrorCode refuse_new_start(MPI_Comm comm, const CheckpointFile& file) {
  PetscFunctionBegin;
  bool same = !is_given("-ts_init_time");
  const std::string given = value_of("-ts_init_time");
  for (const auto& [name, value] : file.options()) same = same || (name == "ts_init_time" && value == given);
  if (!same)
    PetscCall(
        fail(comm, Exit::input,
             format("option -ts_init_time: a continued run begins at the time of its checkpoint, %s: leave the option out", file.name().c_str())));
  PetscFunctionReturn(0);
}

/// In the place of the default end, of a run that nobody has given one.
PetscErrorCode set_far_end(TS ts) {
  PetscReal start, h;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &start));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(TSSetMaxTime(ts, far_from(start, h)));
  PetscFunctionReturn(0);
}

}  // namespace

/// The checkpoint to go on from, if there is one: of the same system and inputs.
PetscErrorCode Run::open_restart() {
  PetscFunctionBegin;
  restart_ = options_.saving.kept;
  if (options_.saving.restart.empty()) PetscFunctionReturn(0);
  const auto file = std::make_shared<CheckpointFile>();
  PetscCall(file->open(model_.comm(), options_.saving.restart));
  PetscCall(file->require_same(model_));
  PetscCall(require_same_inputs(model_.comm(), *file, inputs_));
  PetscCall(refuse_new_start(model_.comm(), *file));
  restart_ = file;
  PetscFunctionReturn(0);
}

PetscErrorCode Run::print_header(const std::string& solver) {
  PetscFunctionBegin;
  std::vector<std::string> lines = model_.describe();
  lines.insert(lines.begin(), program_line(model_.comm()));
  const std::size_t search = solver.find(hooks_.until);
  lines.push_back("solver: " + (hooks_.method.empty() || search == std::string::npos ? solver : hooks_.method + solver.substr(search)));
  if (options_.advise) PetscCall(bs::advise(model_, ts_, context_, &advice_));
  for (const std::string& line : advice_.lines()) lines.push_back(line);
  if (!interval_note_.empty()) lines.push_back(interval_note_);
  if (options_.output.trajectory.file.empty()) lines.push_back("no trajectory is written: give -bs_output F.h5md to write one");
  progress_.header(lines);
  PetscFunctionReturn(0);
}

/// Linear systems have small frames and many short steps: where no interval is given and more than MOST_FRAMES steps of one length are to come, the
/// frames are some steps apart. Steps that an error estimate chooses would be bound by it. It becomes the option's value, so that a continued run has
/// the same.
PetscErrorCode Run::choose_interval() {
  constexpr double MOST_FRAMES = 2000;
  PetscInt limit, done;
  double h;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(is_adaptive(ts_, &adaptive));
  if (adaptive || hooks_.open || is_given("-bs_output_interval") || !model_.linear() || !options_.step.every_step) PetscFunctionReturn(0);
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(TSGetMaxSteps(ts_, &limit));
  PetscCall(TSGetStepNumber(ts_, &done));
  const double steps = std::min((end_ - start_) / h, static_cast<double>(limit - done)), apart = std::ceil(steps / MOST_FRAMES - 1e-9);
  if (!std::isfinite(apart) || apart < 2) PetscFunctionReturn(0);
  options_.step.output_interval = apart * h;
  options_.step.every_step = false;
  PetscCall(PetscOptionsSetValue(nullptr, "-bs_output_interval", format("%.17g", apart * h).c_str()));
  (void)is_given("-bs_output_interval");  // it is in use
  interval_note_ = format("frames: one every %.0f steps, %g s; -bs_output_interval gives another distance, 0 a frame at every step", apart, h);
  PetscFunctionReturn(0);
}

/// Steps end at output times: frames that are closer together than the step is long shorten it. `cut`: to what; 0: they do not.
PetscErrorCode Run::cut_by_output(double* h, double* cut) {
  constexpr double SAME = 1 - 1e-9;
  const double interval = options_.step.output_interval;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(TSGetTimeStep(ts_, h));
  PetscCall(is_adaptive(ts_, &adaptive));
  *cut = adaptive || hooks_.loads || interval >= SAME * std::min(*h, end_ - start_) ? 0 : interval;
  PetscFunctionReturn(0);
}

PetscErrorCode Run::warn_of_interval() {
  double h = 0, interval = 0;
  PetscFunctionBegin;
  PetscCall(cut_by_output(&h, &interval));
  if (!(interval > 0)) PetscFunctionReturn(0);
  PetscCall(warn(model_.comm(), "short_interval",
                 format("option -bs_output_interval: %g s is shorter than the step of %g s: steps end at output times, so that they are "
                        "%g s long; give -ts_dt %g, or a longer interval",
                        interval, h, interval, interval)));
  PetscFunctionReturn(0);
}

/// Sets the solvers up where something about them has to come out before the first step, then warns of unused options.
PetscErrorCode Run::prepare_solvers() {
  std::vector<std::string> unread;
  bool early = false;
  PetscFunctionBegin;
  PetscCall(TSSetUp(ts_));
  PetscCall(unused_options(&unread));
  PetscCall(wants_solvers_early(ts_, context_, !unread.empty(), &early));
  if (early) {
    PetscCall(set_up_solvers(ts_, context_));
    PetscCall(check_first_matrix(ts_, context_));
  }
  if (hooks_.only_run) PetscCall(warn_unused_options(model_.comm()));
  PetscCall(stepper_->attach_solvers(ts_));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::set_up() {
  std::string solver;
  PetscFunctionBegin;
  PetscCall(fingerprint_inputs(model_.comm(), &inputs_));
  PetscCall(open_restart());
  context_.pace = hooks_.pace;
  PetscCall(create_ts(model_, &context_, &ts_));
  if (hooks_.open) PetscCall(set_far_end(ts_));
  if (hooks_.attach) PetscCall(hooks_.attach(ts_, context_));
  PetscCall(set_tolerances(options_.tolerances, model_, ts_));
  PetscCall(TSGetTime(ts_, &start_));
  PetscCall(TSGetMaxTime(ts_, &end_));
  PetscCall(choose_interval());
  options_.step.open = hooks_.open;
  stepper_ = std::make_unique<Stepper>(
      model_, context_, options_.step, [this](const StepRecord& r) { return on_step(r); },
      [this](PetscInt step, double time, Vec y) { return on_frame(step, time, y); }, [this]() { return on_flush(); }, [this]() { return on_save(); });
  if (hooks_.after_break)
    stepper_->set_after_break([this](double time, Vec y, const std::function<PetscErrorCode(Vec)>& frame, bool* found, std::string* failure) {
      return after_break(time, y, frame, found, failure);
    });
  PetscCall(stepper_->attach(ts_));
  if (!hooks_.open) PetscCall(model_.covers(start_, end_));
  if (!context_.implicit) watch_.set_explicit();
  if (model_.linear()) watch_.check_every_step();
  PetscCall(refuse_foreign_options(model_.comm()));
  PetscCall(create_inner_solver(ts_, context_));  // before -help ends: it reads options
  double h, cut;
  PetscCall(cut_by_output(&h, &cut));
  PetscCall(describe_solver(ts_, context_, cut, &solver));
  if (is_given("-help")) PetscFunctionReturn(0);
  solver_ = solver;
  PetscCall(print_header(solver));
  bool adaptive = false;
  PetscCall(is_adaptive(ts_, &adaptive));
  if (adaptive && model_.mechanics() && model_.mechanics()->relaxes())
    PetscCall(warn(model_.comm(), "maxwell_steps",
                   "springs of the law maxwell: the error that steps are adapted to is that of places and velocities, not of their dashpots, "
                   "which steps carry on with order 1: keep steps short beside the relaxation times by -ts_adapt_dt_max"));
  if (options_.advise) PetscCall(step_watch_.begin(ts_, context_, advice_));
  PetscCall(prepare_solvers());
  PetscCall(warn_of_interval());
  if (restart_) PetscCall(continue_from_checkpoint());
  if (!hooks_.loads) {
    Vec y;
    PetscCall(TSGetSolution(ts_, &y));
    PetscCall(remove_earlier_results(model_.comm()));
    PetscCall(write_matrices(model_, stepper_->good_time(), y, options_.output.trajectory.overwrite));
  }
  PetscCall(open_trajectory());
  restart_.reset();
  PetscFunctionReturn(0);
}

/// An end that is given for a continued run and lies before the checkpoint is a mistake.
PetscErrorCode Run::check_end() {
  PetscReal end = 0;
  const double now = stepper_->good_time();
  PetscFunctionBegin;
  PetscCall(TSGetMaxTime(ts_, &end));
  if (is_given("-ts_max_time") && !is_recalled(model_.comm(), "-ts_max_time") && end < now - time_rounding(now))
    PetscCall(fail(model_.comm(), Exit::input,
                   format("option -ts_max_time: %g: %s is at t = %s s already: give a later end, or leave it out", end, restart_->name().c_str(),
                          time_number(now).c_str())));
  PetscFunctionReturn(0);
}

/// Goes on from a checkpoint; says what is not as it was.
PetscErrorCode Run::continue_from_checkpoint() {
  std::vector<std::string> changed;
  PetscFunctionBegin;
  PetscCall(stepper_->restore(ts_, *restart_, &changed));
  if (hooks_.only_run) PetscCall(check_end());
  warnings_.restore(restart_->run());
  start_ = stepper_->start();
  continued_ = restart_->run();
  most_force_ = continued_.real_of("most_force");
  most_speed_ = continued_.real_of("most_speed");
  steps_at_restart_ = stepper_->counts().steps;
  progress_.header({format("continued from %s: step %lld, t = %s s", restart_->name().c_str(), static_cast<long long>(stepper_->counts().steps),
                           time_number(stepper_->good_time()).c_str())});
  if (const auto* const file = dynamic_cast<const CheckpointFile*>(restart_.get()))
    PetscCall(warn_changed_options(model_.comm(), *file, &changed_form_));
  for (const std::string& line : changed) PetscCall(warn(model_.comm(), "continued_otherwise", restart_->name() + ": " + line));
  std::string before;
  for (const std::string& key : warnings_.keys()) before += (before.empty() ? "warnings of the run so far: " : ", ") + key;
  if (!before.empty()) progress_.header({before});
  PetscFunctionReturn(0);
}

PetscErrorCode Run::open_trajectory() {
  TrajectoryOptions options = options_.output.trajectory;
  options.boundary = model_.boundary();
  const TrajectoryMark mark = restart_ ? mark_of(*restart_) : TrajectoryMark{};
  std::vector<Dataset> constants;
  PetscInt numbers;
  PetscFunctionBegin;
  PetscCall(VecGetSize(model_.initial_state(), &numbers));
  if (!options.file.empty() && mark.frames > 0) resumed_ = ask_rank_0(model_.comm(), [&] { return access(options.file.c_str(), F_OK) == 0; });
  if (!options.file.empty() && !resumed_) PetscCall(model_.take_constants(&constants));
  if (!options_.keep_input) model_.release_input();
  if (options.file.empty()) PetscFunctionReturn(0);
  if (resumed_) {
    PetscCall(Trajectory::resume(model_.comm(), options, model_.dim(), numbers, mark, &trajectory_));
    PetscFunctionReturn(0);
  }
  const PetscMPIInt rank = rank_of(model_.comm());
  advice_.put(rank, &constants);
  if (hooks_.tables) hooks_.tables(rank, &constants);
  PetscCall(Trajectory::create(model_.comm(), options, model_.dim(), numbers, constants, &trajectory_));
  PetscFunctionReturn(0);
}

}  // namespace bs
