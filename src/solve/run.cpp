#include "solve/run.hpp"
#include <unistd.h>
#include "base/fault.hpp"
#include "base/options.hpp"
#include "solve/run_parts.hpp"
#include "solve/solver_setup.hpp"
#include "solve/unused.hpp"

namespace bs {
namespace {

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

/// The checkpoint to go on from, if there is one: of the same system and inputs.
PetscErrorCode Run::open_restart() {
  PetscFunctionBegin;
  if (options_.saving.restart.empty()) PetscFunctionReturn(0);
  restart_ = std::make_unique<CheckpointFile>();
  PetscCall(restart_->open(model_.comm(), options_.saving.restart));
  PetscCall(restart_->require_same(model_));
  PetscCall(require_same_inputs(model_.comm(), *restart_, inputs_));
  PetscCall(refuse_new_start(model_.comm(), *restart_));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::say_header(const std::string& solver) {
  PetscMPIInt size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model_.comm(), &size));
  std::vector<std::string> lines = model_.describe();
  lines.insert(lines.begin(), format("backspring %s on %d rank%s", BS_VERSION, size, size > 1 ? "s" : ""));
  lines.push_back("solver: " + solver);
  if (options_.advise) PetscCall(bs::advise(model_, ts_, context_, &advice_));
  for (const std::string& line : advice_.lines()) lines.push_back(line);
  if (options_.output.trajectory.file.empty()) lines.push_back("no trajectory is written: -bs_output F.h5md asks for one");
  progress_.header(lines);
  PetscFunctionReturn(0);
}

/// Sets the solvers up where something about them has to come out before the first step, then warns of options nobody read.
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
  PetscCall(warn_unused_options(model_.comm()));
  PetscCall(stepper_->attach_solvers(ts_));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::set_up() {
  std::string solver;
  PetscBool help = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(fingerprint_inputs(model_.comm(), &inputs_));
  PetscCall(open_restart());
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
  PetscCall(create_inner_solver(ts_, context_));  // before -help ends: it reads options
  PetscCall(describe_solver(ts_, context_, &solver));
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-help", &help));
  if (help) PetscFunctionReturn(0);
  PetscCall(say_header(solver));
  PetscCall(prepare_solvers());
  if (restart_) PetscCall(take_up());
  PetscCall(open_trajectory());
  model_.release_input();
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
  if (options.file.empty()) PetscFunctionReturn(0);
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
  PetscCall(model_.take_constants(&constants));
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
  if (!stepper_->framed() && !(resumed_ && idle())) PetscCall(on_frame(static_cast<PetscInt>(stepper_->counts().steps), stepper_->good_time(), y));
  std::string file = options_.saving.file;
  if (file.empty() && failed && trajectory_) file = options_.output.trajectory.file + ".checkpoint";
  if (file.empty()) PetscFunctionReturn(0);
  if (idle() && (options_.saving.file.empty() || file == options_.saving.restart)) {
    last_checkpoint_ = options_.saving.restart;
    PetscFunctionReturn(0);
  }
  PetscCall(save_run(model_, *stepper_, ts_, y, file, options_.output.trajectory.file, mark, inputs_));
  last_checkpoint_ = file;
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

PetscErrorCode run_model(Model& model, int* exit_code) {
  RunOptions options;
  Claim claim;  // given up when the files are closed
  PetscFunctionBegin;
  PetscCall(read_run_options(model.comm(), &options));
  PetscCall(claim_files(model.comm(), options, &claim));
  Run run(model, options);
  PetscCall(run.set_up());
  PetscCall(run.advance(exit_code));
  PetscFunctionReturn(0);
}

}  // namespace bs
