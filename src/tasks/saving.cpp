#include "tasks/saving.hpp"
#include <filesystem>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/options.hpp"
#include "base/recalled_options.hpp"
#include "output/h5.hpp"
#include "output/output_locks.hpp"
#include "systems/mechanics.hpp"
#include "tasks/run.hpp"
#include "time/stepper.hpp"

namespace bs {

PetscErrorCode read_saving_options(MPI_Comm comm, SavingOptions* options) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Checkpoints", [&](Section& o) {
    o.path("-bs_checkpoint", "checkpoint file to write at the end, on SIGTERM, SIGINT and SIGUSR1, and when a solve fails; default: none is written",
           options->file);
    o.integer("-bs_checkpoint_every", "number of steps between checkpoints during the run; 0: none after a number of steps", options->every,
              Range::nonnegative);
    o.real("-bs_checkpoint_minutes", "wall-clock time between checkpoints during the run; 0: none by the clock [min]", options->minutes,
           Range::nonnegative);
    o.path("-bs_restart", "checkpoint to continue from; its options apply unless they are given again", options->restart);
    if (options->file.empty() && (options->every > 0 || options->minutes > 0))
      o.fail("options -bs_checkpoint_every and -bs_checkpoint_minutes: say with -bs_checkpoint which file to write");
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode flushed_mark(Trajectory* trajectory, TrajectoryMark* mark) {
  PetscFunctionBegin;
  *mark = {};
  if (!trajectory) PetscFunctionReturn(0);
  PetscCall(trajectory->flush());
  *mark = trajectory->mark();
  PetscFunctionReturn(0);
}

/// What the run at y goes on from: added to its facts, and in states.
static PetscErrorCode gather_run(const Stepper& stepper, TS ts, Vec y, Facts* run, std::vector<NamedState>* states) {
  TSType type;
  PetscFunctionBegin;
  PetscCall(TSGetType(ts, &type));
  run->text["ts_type"] = type;
  *states = {{"/state", y}};
  stepper.save(run, states);
  PetscFunctionReturn(0);
}

PetscErrorCode keep_run(Model& model, const Stepper& stepper, TS ts, Vec y, const Facts& facts, KeptCheckpoint* out) {
  Facts run = facts;
  std::vector<NamedState> states;
  PetscFunctionBegin;
  PetscCall(gather_run(stepper, ts, y, &run, &states));
  PetscCall(out->keep(model, run, states));
  PetscCall(stepper.renew_solver(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode save_run(Model& model, const Stepper& stepper, TS ts, Vec y, const std::string& file, const std::string& trajectory,
                        const TrajectoryMark& mark, const Facts& facts) {
  Facts run = facts;
  std::vector<NamedState> states;
  PetscFunctionBegin;
  run.text["trajectory"] = value_to_save(model.comm(), "-bs_output", trajectory);
  run.whole["frames"] = mark.frames;
  run.whole["log_rows"] = mark.log_rows;
  run.real["last_frame_time"] = mark.last_time;
  PetscCall(gather_run(stepper, ts, y, &run, &states));
  set_phase(model.comm(), Exit::io);
  PetscCall(write_checkpoint(model, file, run, states));
  PetscCall(stepper.renew_solver(ts));
  set_phase(model.comm(), Exit::solve);
  PetscFunctionReturn(0);
}

namespace {

bool is_checkpoint_of(const std::string& file, const std::string& trajectory) {
  std::error_code none;
  if (std::filesystem::is_symlink(file, none) || !is_checkpoint(file)) return false;
  const H5 opened(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (opened < 0 || !h5_exists(opened, "/run")) return false;
  const std::string named = fixed_text(opened, "/run", "trajectory");
  return named == trajectory || std::filesystem::equivalent(named, trajectory, none);
}

}  // namespace

PetscErrorCode remove_stale_checkpoint(MPI_Comm comm, const std::string& trajectory, const std::string& kept) {
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  const std::string stale = trajectory + ".checkpoint";
  if (rank != 0 || stale == kept) PetscFunctionReturn(0);
  std::error_code none;
  if (!kept.empty() && std::filesystem::equivalent(stale, kept, none)) PetscFunctionReturn(0);
  for (const std::string& file : {stale, previous_checkpoint(stale)})
    if (is_checkpoint_of(file, trajectory)) std::filesystem::remove(file, none);
  PetscFunctionReturn(0);
}

TrajectoryMark mark_of(const Checkpoint& file) {
  const Facts& run = file.run();
  return {run.whole_of("frames"), run.whole_of("log_rows"), run.real_of("last_frame_time")};
}

/// A checkpoint's name of a number that the run began with.
static std::string begin_key(const Observable& o, std::size_t k) { return format("begin_%s_%zu", o.name.c_str(), k); }

/// What a checkpoint holds of the run besides its stepping: what it has counted, and what it goes by.
PetscErrorCode Run::facts(Facts* now) const {
  Facts run = inputs_;
  PetscFunctionBegin;
  for (const Tally& tally : tallies()) run.whole["count_" + tally.key] = tally.count;
  run.real["time"] = stepper_->good_time();
  run.real["most_force"] = most_force_;
  run.real["most_speed"] = most_speed_;
  for (const Observable& o : first_)
    for (std::size_t k = 0; k < o.value.size(); ++k) run.real[begin_key(o, k)] = o.value[k];
  watch_.save(&run);
  tolerance_watch_.save(&run);
  PetscCall(warnings_.save(&run));
  if (hooks_.save) hooks_.save(&run);
  *now = std::move(run);
  PetscFunctionReturn(0);
}

/// Those of the last good state: where steps may be taken back, they were kept there.
PetscErrorCode Run::good_facts(Facts* good) const {
  PetscFunctionBegin;
  if (hooks_.after_break) *good = good_facts_;
  else PetscCall(facts(good));
  PetscFunctionReturn(0);
}

/// After the look at the state that a continued run begins with: what that counts is counted already.
void Run::restore_facts() {
  if (steps_at_restart_ < 0) return;
  watch_.restore(continued_);
  tolerance_watch_.restore(continued_);
  if (hooks_.restore) hooks_.restore(continued_);
  for (const Tally& tally : tallies()) {
    const auto was = continued_.whole.find("count_" + tally.key);
    if (was != continued_.whole.end()) earlier_[tally.key] = was->second - tally.count;
  }
  for (Observable& o : first_)
    for (std::size_t k = 0; k < o.value.size(); ++k) o.value[k] = continued_.real_of(begin_key(o, k), o.value[k]);
}

PetscErrorCode Run::on_save() {
  PetscFunctionBegin;
  if (!options_.saving.file.empty() && !spoiled_) PetscCall(save(options_.saving.file));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::save(const std::string& file) {
  TrajectoryMark mark;
  Facts good;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(flushed_mark(trajectory_.get(), &mark));
  PetscCall(good_facts(&good));
  PetscCall(save_run(model_, *stepper_, ts_, y, file, options_.output.trajectory.file, mark, good));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::keep(KeptCheckpoint* out) {
  Facts good;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(good_facts(&good));
  PetscCall(keep_run(model_, *stepper_, ts_, y, good, out));
  PetscFunctionReturn(0);
}

/// The last good state: a frame of its own if it has none, and a checkpoint, also of a failed run that was given no name for
/// one. The checkpoint knows nothing of a frame between output times, which a continued run takes away. A continued run that
/// took no step leaves the trajectory, and the checkpoint it came from, as they were.
PetscErrorCode Run::save_last(bool failed) {
  TrajectoryMark mark;
  Facts good;
  Vec y;
  PetscFunctionBegin;
  PetscCall(good_facts(&good));
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(flushed_mark(trajectory_.get(), &mark));
  if (abandoned_.shown) mark = abandoned_.before;
  if (abandoned_.shown || (!stepper_->framed() && !untouched()))
    PetscCall(on_frame(static_cast<PetscInt>(stepper_->counts().steps), stepper_->good_time(), y));
  else if (observed_ != stepper_->good_time()) PetscCall(observe(stepper_->good_time(), y));  // the last look was at a step that was taken back
  if (!hooks_.checkpoints || spoiled_ || (model_.mechanics() && !model_.mechanics()->given_motion().empty())) PetscFunctionReturn(0);
  std::string file = options_.saving.file;
  if (file.empty() && failed && trajectory_) file = options_.output.trajectory.file + ".checkpoint";
  if (file.empty()) PetscFunctionReturn(0);
  if (idle() && (options_.saving.file.empty() || file == options_.saving.restart)) {
    last_checkpoint_ = options_.saving.restart;
    PetscFunctionReturn(0);
  }
  PetscCall(save_run(model_, *stepper_, ts_, y, file, options_.output.trajectory.file, mark, good));
  last_checkpoint_ = file;
  PetscFunctionReturn(0);
}

}  // namespace bs
