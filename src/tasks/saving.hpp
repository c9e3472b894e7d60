// When checkpoints are written, and what goes into them.
#pragma once
#include <petscts.h>
#include <memory>
#include <string>
#include "checkpoint/checkpoint.hpp"
#include "output/trajectory.hpp"

namespace bs {

class Stepper;

struct SavingOptions {
  std::string file;                        ///< -bs_checkpoint; empty: only where a solve fails, beside the trajectory
  std::int64_t every = 0;                  ///< -bs_checkpoint_every [steps]
  double minutes = 0;                      ///< -bs_checkpoint_minutes [min] of wall-clock time
  std::string restart;                     ///< -bs_restart; empty: from the start
  std::shared_ptr<const Checkpoint> kept;  ///< in the place of that file; null: none is
};

/// Collective. TRAJECTORY.checkpoint and the one before it, which failed runs leave, are removed where they are checkpoints of this
/// trajectory, but not `kept`.
PetscErrorCode remove_stale_checkpoint(MPI_Comm comm, const std::string& trajectory, const std::string& kept);

/// Collective. Reads the options; ends the run with exit code 2 if they contradict each other.
PetscErrorCode read_saving_options(MPI_Comm comm, SavingOptions* options);

/// Collective. What is on disk of the trajectory, after a flush; of no trajectory: nothing.
PetscErrorCode flushed_mark(Trajectory* trajectory, TrajectoryMark* mark);

/// Collective. Writes the last good state `y` of `stepper`, where the trajectory stood then and the facts of the run. A failure ends the run with
/// exit code 4.
PetscErrorCode save_run(Model& model, const Stepper& stepper, TS ts, Vec y, const std::string& file, const std::string& trajectory,
                        const TrajectoryMark& mark, const Facts& facts);

/// Collective. The last good state `y` of `stepper` and the facts of the run, in memory.
PetscErrorCode keep_run(Model& model, const Stepper& stepper, TS ts, Vec y, const Facts& facts, KeptCheckpoint* out);

/// Where the trajectory stood when `file` was written.
TrajectoryMark mark_of(const Checkpoint& file);

}  // namespace bs
