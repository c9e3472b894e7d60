#include "tasks/saving.hpp"
#include <filesystem>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/options.hpp"
#include "output/h5.hpp"
#include "output/output_locks.hpp"
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

PetscErrorCode save_run(Model& model, const Stepper& stepper, TS ts, Vec y, const std::string& file, const std::string& trajectory,
                        const TrajectoryMark& mark, const Facts& facts) {
  Facts run = facts;
  TSType type;
  std::vector<NamedState> states = {{"/state", y}};
  PetscFunctionBegin;
  PetscCall(TSGetType(ts, &type));
  run.text["ts_type"] = type;
  run.text["trajectory"] = trajectory;
  run.whole["frames"] = mark.frames;
  run.whole["log_rows"] = mark.log_rows;
  run.real["last_frame_time"] = mark.last_time;
  stepper.save(&run, &states);
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

TrajectoryMark mark_of(const CheckpointFile& file) {
  const Facts& run = file.run();
  return {run.whole_of("frames"), run.whole_of("log_rows"), run.real_of("last_frame_time")};
}

}  // namespace bs
