// A session's model and its run.
#include <petscts.h>
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/option_names.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "output/fresh_file.hpp"
#include "session/session_impl.hpp"
#include "session/tasks.hpp"
#include "systems/create.hpp"
#include "systems/frame_rows.hpp"
#include "systems/mechanics.hpp"
#include "tasks/modes.hpp"
#include "tasks/statics/box_stress.hpp"

namespace bs {

Session::Impl::~Impl() {
  drop_statics();
  {
    const Inside inside(comm, options);
    run.reset();
    model.reset();
  }
  if (comm != MPI_COMM_NULL && !borrowed) MPI_Comm_free(&comm);
}

PetscErrorCode Session::Impl::open() {
  PetscFunctionBegin;
  if (model) PetscFunctionReturn(0);
  PetscCall(take_up_settings());
  PetscCall(make_model(&model));
  PetscCall(model->fingerprint(&made_of));
  PetscCall(count_particles());
  PetscCall(read_start_time(&start));
  PetscFunctionReturn(0);
}

/// They are for steps and for analyses.
PetscErrorCode Session::Impl::take_up_settings() {
  PetscFunctionBegin;
  PetscCall(take_up_options(comm));
  PetscCall(read_mode_options(comm));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::make_model(std::unique_ptr<Model>* out) {
  PetscFunctionBegin;
  PetscCall(create_model(comm, out, given.get()));
  dim = (*out)->dim();
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::count_particles() {
  std::vector<StatePart> parts;
  PetscInt first = 0, end = 0, size = 0, width = 1;
  PetscFunctionBegin;
  if (!model->mechanics()) PetscFunctionReturn(0);
  PetscCall(model->gather_state(model->initial_state(), &parts));
  PetscCall(VecGetBlockSize(parts[0].vec, &width));
  PetscCall(VecGetSize(parts[0].vec, &size));
  PetscCall(VecGetOwnershipRange(parts[0].vec, &first, &end));
  particles = {first / width, (end - first) / width, size / width};
  PetscFunctionReturn(0);
}

/// The motion of the model, ready to begin. `user`, for messages: what asks for it.
PetscErrorCode Session::Impl::make_run(const char* user, bool keep_input, const RunHooks& hooks, std::unique_ptr<Run>* out) {
  RunOptions run_options;
  PetscFunctionBegin;
  PetscCall(refuse_box_stress(*model, user));
  PetscCall(read_run_options(comm, Steps::time, &run_options));
  if (run_options.rest > 0 && !model->mechanics()) PetscCall(fail(comm, Exit::input, "option -bs_stop_at_rest is for particles: leave it out"));
  run_options.keep_input = keep_input;
  run_options.saving.kept = resumed;
  locks = std::make_unique<OutputLocks>();
  PetscCall(lock_outputs(comm, run_options, locks.get()));
  *out = std::make_unique<Run>(*model, run_options, hooks);
  PetscCall((*out)->set_up());
  PetscFunctionReturn(0);
}

/// The task of the program: a motion from its start to its end, or the options that it reads.
PetscErrorCode Session::Impl::dynamics(int* exit_code) {
  std::unique_ptr<Run> whole;
  PetscFunctionBegin;
  PetscCall(make_model(&model));
  PetscCall(make_run("-bs_task dynamics", false, {}, &whole));
  PetscCall(whole->advance(exit_code));
  PetscFunctionReturn(0);
}

/// Up to the first step: the run of the program, with the session's observers.
PetscErrorCode Session::Impl::begin() {
  RunHooks hooks;
  std::unique_ptr<Run> fresh;
  PetscFunctionBegin;
  if (finished) PetscCall(fail(comm, Exit::input, "the session is finished: create another one"));
  if (run) PetscFunctionReturn(0);
  PetscCall(open());
  hooks.on_step = [this](const StepRecord& record) {
    if (step_observer) step_observer(record);
  };
  hooks.on_frame = [this](double time) {
    if (frame_observer) frame_observer(time);
    if (stop_at_frame && run) (void)run->pause();
  };
  hooks.pace.end += start;
  hooks.open = !is_given("-ts_max_time");
  PetscCall(make_run("a session that steps in time", true, hooks, &fresh));
  end_of_settings = hooks.open ? std::nan("") : fresh->end_time();
  if (std::isnan(end_of_settings)) PetscCall(fresh->leave_open());
  if (resumed) {
    earlier_steps -= fresh->steps();
  } else if (given_state) {
    Vec y;
    PetscCall(fresh->state_vector(&y));
    PetscCall(VecCopy(given_state, y));
    PetscCall(model->mechanics()->begin_at(start, y));
  }
  given_state.reset();
  resumed.reset();
  PetscCall(fresh->count_earlier(earlier_steps));
  PetscCall(fresh->begin());
  run = std::move(fresh);
  PetscFunctionReturn(0);
}

/// A run that a poll has ended; 0: none has.
PetscErrorCode Session::Impl::stopped(int exit_code) const {
  PetscFunctionBegin;
  if (exit_code) PetscCall(fail(comm, static_cast<Exit>(exit_code), format("stopped by signal %d", exit_code - 128)));
  PetscFunctionReturn(0);
}

/// Where a step has failed, before another one. That run does not go on: nothing that the attempt left in PETSc's steppers goes into what follows.
/// The next one begins with the last good state, and with a method without history.
PetscErrorCode Session::Impl::leave_failed_run() {
  Vec y;
  PetscFunctionBegin;
  if (!failed || finished) PetscFunctionReturn(0);
  if (const std::string file = file_of_run(); !file.empty())
    PetscCall(fail(comm, Exit::solve,
                   "the run has failed, and the file of option " + file + " ends there: begin another one, from its checkpoint where it has one"));
  PetscCall(run->state_vector(&y));
  PetscCall(copy_into(&given_state, y));
  PetscCall(start_anew(run->time(), steps_so_far()));
  PetscFunctionReturn(0);
}

/// Up to the end, or so many steps.
PetscErrorCode Session::Impl::advance(std::int64_t count) {
  const std::int64_t before = run->steps();
  std::string why;
  PetscFunctionBegin;
  const PetscErrorCode code = run->go_on(count);
  if (!code) PetscCall(run->trouble(&why));
  failed = code || !why.empty();
  if (failed) PetscCall(run->return_to_good());
  PetscCall(code);
  if (why.empty() && run->signal()) PetscCall(stopped(128 + run->signal()));
  if (why.empty() && run->steps() == before) why = "no step was taken: -ts_max_steps allows no more";
  if (!why.empty()) PetscCall(fail(comm, Exit::solve, why));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::step(std::int64_t count) {
  PetscFunctionBegin;
  PetscCall(leave_failed_run());
  PetscCall(begin());
  paused = false;
  for (const std::int64_t last = run->steps() + count; run->steps() < last && !paused;) {
    if (run->at_end()) PetscCall(run->leave_open());
    PetscCall(advance(last - run->steps()));
  }
  PetscCall(return_to_end());
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::run_until(double t) {
  PetscFunctionBegin;
  PetscCall(leave_failed_run());
  PetscCall(begin());
  if (!(t > run->time())) PetscFunctionReturn(0);
  PetscCall(run->set_end(t));
  paused = false;
  PetscErrorCode code = 0;
  while (!code && !run->at_end() && !run->rests() && !paused) code = advance(-1);
  if (run) PetscCall(return_to_end());
  PetscFunctionReturn(code);
}

/// The end that a call has given is none of those that follow: theirs is that of the settings.
PetscErrorCode Session::Impl::return_to_end() {
  PetscFunctionBegin;
  if (std::isnan(end_of_settings)) PetscCall(run->leave_open());
  else PetscCall(run->set_end(end_of_settings));
  PetscFunctionReturn(0);
}

/// The step that lands on an output time pauses the run, which stands there.
PetscErrorCode Session::Impl::run_to_frame(bool* more) {
  bool spent = false;
  PetscFunctionBegin;
  PetscCall(leave_failed_run());
  PetscCall(begin());
  PetscCall(run->out_of_steps(&spent));
  *more = !spent && !run->at_end() && !run->rests();
  if (!*more) PetscFunctionReturn(0);
  stop_at_frame = true;
  const PetscErrorCode code = advance(run->output_interval() > 0 ? -1 : 1);
  stop_at_frame = false;
  PetscFunctionReturn(code);
}

PetscErrorCode Session::Impl::finish() {
  int exit_code = 0;
  std::string told;
  PetscFunctionBegin;
  if (finished || !run) PetscFunctionReturn(0);
  finished = true;
  PetscCall(run->trouble(&told));
  PetscErrorCode code = run->end(&exit_code);
  locks.reset();
  if (code && !told.empty() && last_error(comm).exit == Exit::solve) code = 0;  // the call whose step failed has said so
  PetscFunctionReturn(code);
}

PetscErrorCode Session::Impl::forces(double t, Vec y, Array what, std::vector<double>* rows) {
  const double* f = nullptr;
  std::vector<double> reactions;
  PetscFunctionBegin;
  if (what == Array::force) PetscCall(model->mechanics()->force(t, y, &f));
  else PetscCall(model->mechanics()->reactions(t, y, &reactions));
  if (what == Array::reaction) f = reactions.data();
  PetscCall(rows_of_particles(*model, y, f, rows));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::get(Array what, std::vector<double>* rows) {
  Vec y;
  PetscFunctionBegin;
  PetscCall(begin());
  PetscCall(require_particles());
  PetscCall(run->state_vector(&y));
  if (what == Array::force || what == Array::reaction) PetscCall(forces(run->time(), y, what, rows));
  else PetscCall(frame_rows(*model, run->time(), y, what == Array::position ? "/position" : "/velocity", rows));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::get_frame(FrameData* out) {
  Vec y;
  PetscFunctionBegin;
  PetscCall(begin());
  PetscCall(run->state_vector(&y));
  out->time = run->time();
  PetscCall(model->observe(out->time, y, &out->observables));
  PetscCall(read_tables(*model, out->time, y, &out->tables));
  PetscCall(read_breaks(*model, &out->breaks));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::checkpoint(const std::string& file) {
  PetscFunctionBegin;
  PetscCall(begin());
  const std::string option = model->mechanics() ? model->mechanics()->given_motion() : "";
  if (!option.empty())
    PetscCall(fail(comm, Exit::input, "option " + option + ": a checkpoint does not say where given motions lead: save the state in memory"));
  std::string fault;
  if (rank_of(comm) == 0) fault = locks->taken(file);
  if (rank_of(comm) == 0 && fault.empty()) fault = unwritable(file, "a checkpoint", true);
  PetscCall(share_text(comm, &fault));
  if (!fault.empty()) PetscCall(fail(comm, Exit::io, fault));
  PetscCall(run->save(file));
  PetscFunctionReturn(0);
}

/// On a model of its own.
PetscErrorCode Session::Impl::modes(Result* out, const SavedState* about, int* exit_code) {
  std::unique_ptr<Model> fresh;
  PetscFunctionBegin;
  PetscCall(make_model(&fresh));
  PetscCall(run_modes(std::move(fresh), about, out, exit_code));
  PetscFunctionReturn(0);
}

}  // namespace bs
