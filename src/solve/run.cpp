#include "solve/run.hpp"
#include <unistd.h>
#include "base/fault.hpp"
#include "base/options.hpp"
#include "output/claim.hpp"
#include "solve/run_parts.hpp"

namespace bs {
namespace {

PetscErrorCode read_options(MPI_Comm comm, RunOptions* out) {
  PetscFunctionBegin;
  PetscCall(read_output_settings(comm, &out->output));
  out->step.output_interval = out->output.interval;
  out->step.every_step = out->output.interval == 0 && !out->output.trajectory.file.empty();
  PetscCall(read_advise(comm, &out->advise));
  PetscCall(read_section(comm, "Program", [&](Section& o) {
    bool version = false, trace = false;
    o.flag("-bs_version", "print the version and end", version);
    o.flag("-bs_trace", "errors with PETSc's full traceback, for developers", trace);
  }));
  PetscCall(read_section(comm, "Stepping", [&](Section& o) {
    o.real("-bs_step_cut", "factor on the step after a failed solve, between 0 and 1", out->step.cut, Range::positive);
    o.integer("-bs_step_grow_after", "good steps before a cut step grows back toward -ts_dt", out->step.grow_after, Range::positive);
    o.real("-bs_step_min", "no attempt at a shorter step than this after a rejected one: the run ends, exit code 3; 0: any [s]", out->step.step_min, Range::nonnegative);
    o.integer("-bs_step_max_cuts", "rejected attempts at one step that are borne before the run ends, exit code 3", out->step.max_cuts, Range::nonnegative);
    o.real("-bs_step_first", "first step; 0: -ts_dt, or a thousandth of it where -ts_adapt_type works without an error estimate of it (beuler, cn, theta) [s]", out->step.first, Range::nonnegative);
    o.real("-bs_energy_growth", "warn once, and go on, where kinetic and elastic energy are more than so many times (explicit types: ten times as "
           "many) what the start, outer fields, driven anchors and the fluid have given; 0: never [1]", out->energy_growth, Range::nonnegative);
    if (out->step.cut >= 1) o.fail("option -bs_step_cut: give a number between 0 and 1, e.g. 0.25");
  }));
  PetscCall(read_tolerances(comm, &out->tolerances));
  PetscCall(read_saving_options(comm, &out->saving));
  out->step.save_every = out->saving.every;
  out->step.save_minutes = out->saving.minutes;
  PetscFunctionReturn(0);
}

PetscErrorCode claim_files(MPI_Comm comm, const RunOptions& options, Claim* claim) {
  RunFiles files;
  CheckpointFile checkpoint;
  PetscFunctionBegin;
  files.output = options.output.trajectory.file;
  files.xdmf = options.output.trajectory.xdmf;
  files.overwrite = options.output.trajectory.overwrite;
  files.report = options.output.report;
  files.checkpoint = options.saving.file;
  files.restart = options.saving.restart;
  if (!files.restart.empty()) {
    PetscCall(checkpoint.open(comm, files.restart));
    files.resumes = mark_of(checkpoint).frames > 0;
  }
  PetscCall(claim->take(comm, files));
  PetscFunctionReturn(0);
}

/// A continued run begins where the checkpoint was written.
PetscErrorCode refuse_new_start(MPI_Comm comm, const CheckpointFile& file) {
  char given[64] = "";
  PetscBool there = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-ts_init_time", given, sizeof given, &there));
  bool same = !there;
  for (const auto& [name, value] : file.options()) same = same || (name == "ts_init_time" && value == given);
  if (!same)
    PetscCall(tell(comm, Exit::input, format("option -ts_init_time: a continued run begins at the time of its checkpoint, %s: leave the option out",
                                             file.name().c_str())));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode Run::set_up() {
  PetscFunctionBegin;
  PetscCall(fingerprint_inputs(model_.comm(), &inputs_));
  if (!options_.saving.restart.empty()) {
    restart_ = std::make_unique<CheckpointFile>();
    PetscCall(restart_->open(model_.comm(), options_.saving.restart));
    PetscCall(restart_->require_same(model_));
    PetscCall(require_same_inputs(model_.comm(), *restart_, inputs_));
    PetscCall(refuse_new_start(model_.comm(), *restart_));
  }
  PetscCall(create_ts(model_, &context_, &ts_));
  PetscCall(set_tolerances(options_.tolerances, model_, ts_));
  PetscCall(TSGetTime(ts_, &start_));
  PetscCall(TSGetMaxTime(ts_, &end_));
  stepper_ = std::make_unique<Stepper>(
      model_, context_, options_.step, [this](const StepRecord& r) { return on_step(r); },
      [this](PetscInt step, double time, Vec y) { return on_frame(step, time, y); }, [this]() { return on_save(); });
  PetscCall(stepper_->attach(ts_));
  PetscCall(model_.covers(end_));
  if (!context_.implicit) watch_.set_explicit();
  PetscCall(reject_unknown_options(model_.comm()));
  std::string solver;
  PetscCall(describe_solver(ts_, context_, &solver));  // before -help ends: it reads the options of the inner solver
  PetscBool help = PETSC_FALSE;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-help", &help));
  if (help) PetscFunctionReturn(0);
  std::vector<std::string> lines = model_.describe();
  lines.push_back("solver: " + solver);
  if (options_.advise) PetscCall(bs::advise(model_, ts_, context_, &advice_));
  for (const std::string& line : advice_.lines()) lines.push_back(line);
  if (options_.output.trajectory.file.empty()) lines.push_back("no trajectory is written: -bs_output F.h5md asks for one");
  PetscMPIInt size;
  PetscCallMPI(MPI_Comm_size(model_.comm(), &size));
  lines.insert(lines.begin(), format("backspring %s on %d rank%s", BS_VERSION, size, size > 1 ? "s" : ""));
  progress_.header(lines);
  PetscCall(warn_unused_options(ts_, context_));
  PetscCall(stepper_->attach_solvers(ts_));
  if (restart_) PetscCall(take_up());
  PetscCall(open_trajectory());
  restart_.reset();
  PetscFunctionReturn(0);
}

/// Goes on from a checkpoint; says what is not as it was.
PetscErrorCode Run::take_up() {
  std::vector<std::string> changed;
  PetscFunctionBegin;
  PetscCall(stepper_->restore(ts_, *restart_, &changed));
  start_ = stepper_->start();
  taken_up_ = stepper_->counts().steps;
  progress_.header({format("continued from %s: step %lld, t = %.17g s", options_.saving.restart.c_str(),
                           static_cast<long long>(stepper_->counts().steps), stepper_->good_time())});
  PetscCall(tell_changed_options(model_.comm(), *restart_));
  for (const std::string& line : changed) PetscCall(warn(model_.comm(), options_.saving.restart + ": " + line));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::open_trajectory() {
  const TrajectoryOptions& options = options_.output.trajectory;
  std::vector<Dataset> constants;
  PetscFunctionBegin;
  if (options.file.empty()) {
    PetscCall(model_.constants(&constants));  // nothing is written, but the model lets go of its input
    PetscFunctionReturn(0);
  }
  const TrajectoryMark mark = restart_ ? mark_of(*restart_) : TrajectoryMark{};
  int there = 0;
  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(model_.comm(), &rank));
  if (rank == 0) there = access(options.file.c_str(), F_OK) == 0;
  PetscCallMPI(MPI_Bcast(&there, 1, MPI_INT, 0, model_.comm()));
  if (there && mark.frames > 0) {
    PetscCall(Trajectory::resume(model_.comm(), options, model_.dim(), mark, &trajectory_));
    resumed_ = true;
    stepper_->set_framed(mark.last_time == stepper_->good_time());
    PetscFunctionReturn(0);
  }
  PetscCall(model_.constants(&constants));
  advice_.put(rank, &constants);
  PetscCall(Trajectory::create(model_.comm(), options, model_.dim(), constants, &trajectory_));
  PetscFunctionReturn(0);
}

RunState Run::state() const {
  const RunCounts& c = stepper_->counts();
  return {stepper_->good_time(), start_, end_, c.steps, c.rejected, c.newton, c.krylov, total_energy(last_), in_words(stepper_->rejections().counts()),
          static_cast<std::int64_t>(warnings().size())};
}

PetscErrorCode Run::on_step(const StepRecord& record) {
  PetscFunctionBegin;
  constexpr int MOST_ROWS = 4096;  // of the log that are held in memory: half a megabyte
  Vec y;
  if (trajectory_) trajectory_->log_step(record);
  if (trajectory_ && (++held_rows_ >= MOST_ROWS || stepper_->log_due())) {
    set_phase(Exit::io);
    PetscCall(trajectory_->flush());
    set_phase(Exit::solve);
    held_rows_ = 0;
  }
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(watch_.look(static_cast<PetscInt>(record.step), record.time, y, false));
  progress_.update(state());
  PetscFunctionReturn(0);
}

PetscErrorCode Run::on_frame(PetscInt step, double time, Vec y) {
  PetscFunctionBegin;
  PetscCall(model_.observe(time, y, &last_));
  PetscCall(watch_.look(step, time, y, true));
  if (first_.empty()) first_ = last_;
  if (trajectory_) {
    std::vector<Field> fields;
    PetscCall(model_.fields(time, y, &fields));
    set_phase(Exit::io);
    PetscCall(trajectory_->write_frame(step, time, fields, last_));
    held_rows_ = 0;
    set_phase(Exit::solve);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Run::on_save() {
  TrajectoryMark mark;
  Vec y;
  PetscFunctionBegin;
  if (options_.saving.file.empty()) PetscFunctionReturn(0);
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(flushed_mark(trajectory_.get(), &mark));
  PetscCall(save_run(model_, *stepper_, ts_, y, options_.saving.file, options_.output.trajectory.file, mark, inputs_));
  PetscFunctionReturn(0);
}

/// The last good state: a frame of its own if it has none, and a checkpoint, also of a failed run that was given no name for
/// one. The checkpoint knows nothing of a frame between output times, which a continued run takes away. A continued run that
/// took no step leaves the trajectory, and the checkpoint it came from, as they were.
PetscErrorCode Run::save_last(bool failed) {
  TrajectoryMark mark;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(flushed_mark(trajectory_.get(), &mark));
  if (!stepper_->framed() && !(resumed_ && idle())) PetscCall(on_frame(stepper_->counts().steps, stepper_->good_time(), y));
  std::string file = options_.saving.file;
  if (file.empty() && failed && trajectory_) file = options_.output.trajectory.file + ".checkpoint";
  if (file.empty()) PetscFunctionReturn(0);
  if (idle() && (options_.saving.file.empty() || file == options_.saving.restart)) {
    saved_ = options_.saving.restart;
    PetscFunctionReturn(0);
  }
  PetscCall(save_run(model_, *stepper_, ts_, y, file, options_.output.trajectory.file, mark, inputs_));
  saved_ = file;
  PetscFunctionReturn(0);
}

PetscErrorCode Run::advance(int* exit_code) {
  Vec y;
  PetscInt first_step;
  TSConvergedReason reason;
  PetscFunctionBegin;
  *exit_code = 0;
  PetscBool help = PETSC_FALSE;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-help", &help));
  if (help) PetscFunctionReturn(0);
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(TSGetStepNumber(ts_, &first_step));
  set_phase(Exit::solve);
  if (resumed_) {
    PetscCall(model_.observe(stepper_->good_time(), y, &last_));
    PetscCall(watch_.look(first_step, stepper_->good_time(), y, true));
  }
  if (!resumed_) PetscCall(on_frame(first_step, stepper_->good_time(), y));
  if (first_.empty()) first_ = last_;
  PetscCall(TSSolve(ts_, nullptr));
  PetscCall(TSGetConvergedReason(ts_, &reason));
  PetscCall(save_last(reason < 0));
  PetscCall(conclude(reason, exit_code));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::conclude(TSConvergedReason reason, int* exit_code) {
  PetscFunctionBegin;
  std::string why;
  const bool failed = reason < 0;
  if (failed) PetscCall(explain(reason, &why));
  else if (stepper_->signal()) why = format("stopped by signal %d", stepper_->signal());
  if (trajectory_) {
    set_phase(Exit::io);
    PetscCall(trajectory_->close());
  }
  // of a run before this one, whose trajectory is no more
  if (!failed && !stepper_->signal() && trajectory_ && options_.output.trajectory.overwrite && options_.saving.restart.empty())
    PetscCall(remove_stale_checkpoint(model_.comm(), options_.output.trajectory.file, options_.saving.file));
  PetscCall(report(failed ? "failed" : stepper_->signal() ? "stopped" : "ok", why));
  if (failed && !saved_.empty()) why += format("; the last good state is in %s (-bs_restart)", saved_.c_str());
  if (failed) PetscCall(tell(model_.comm(), Exit::solve, why));
  if (stepper_->signal()) *exit_code = 128 + stepper_->signal();
  PetscFunctionReturn(0);
}

PetscErrorCode run_model(Model& model, int* exit_code) {
  RunOptions options;
  Claim claim;  // given up when the files are closed
  PetscFunctionBegin;
  PetscCall(read_options(model.comm(), &options));
  PetscCall(claim_files(model.comm(), options, &claim));
  Run run(model, options);
  PetscCall(run.set_up());
  PetscCall(run.advance(exit_code));
  PetscFunctionReturn(0);
}

}  // namespace bs
