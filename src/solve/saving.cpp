#include "solve/saving.hpp"
#include "base/fault.hpp"
#include "base/options.hpp"
#include "solve/stepper.hpp"

namespace bs {

PetscErrorCode read_saving_options(MPI_Comm comm, SavingOptions* options) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Checkpoints", [&](Section& o) {
    o.text("-bs_checkpoint", "file to continue from: written at the end, on SIGTERM, SIGINT, SIGUSR1 and when a solve fails; none without", options->file);
    o.integer("-bs_checkpoint_every", "and every so many steps; 0: not by steps", options->every, Range::nonnegative);
    o.real("-bs_checkpoint_minutes", "and after so much wall-clock time; 0: not by the clock [min]", options->minutes, Range::nonnegative);
    o.text("-bs_restart", "checkpoint to continue from; its options are in force where none is given", options->restart);
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
                        const TrajectoryMark& mark, const Facts& inputs) {
  Facts run = inputs;
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
  set_phase(Exit::io);
  PetscCall(write_checkpoint(model, file, run, states));
  PetscCall(stepper.renew_solver(ts));
  set_phase(Exit::solve);
  PetscFunctionReturn(0);
}

TrajectoryMark mark_of(const CheckpointFile& file) {
  const Facts& run = file.run();
  const auto whole = [&](const char* name) { return run.whole.count(name) ? run.whole.at(name) : 0; };
  return {whole("frames"), whole("log_rows"), run.real.count("last_frame_time") ? run.real.at("last_frame_time") : 0.0};
}

}  // namespace bs
