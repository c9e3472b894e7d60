// The settings of a run from the options, and the files that it may write.
#pragma once
#include <string>
#include "output/output_locks.hpp"
#include "output/trajectory.hpp"
#include "tasks/adviser.hpp"
#include "tasks/saving.hpp"
#include "time/stepper.hpp"
#include "time/ts_setup.hpp"

namespace bs {

struct OutputSettings {
  TrajectoryOptions trajectory;
  double interval = 0;           ///< -bs_output_interval: simulated time between frames [s]; 0: every step
  std::string report;            ///< -bs_report: file of the closing report; empty: none
  double progress_interval = 5;  ///< -bs_progress_interval [s]
};

struct RunOptions {
  OutputSettings output;
  StepOptions step;
  bool advise = true;
  bool keep_input = false;    ///< the model keeps the lattice as it was read: another task writes it
  double rest = 0;            ///< -bs_stop_at_rest
  double energy_growth = 10;  ///< -bs_energy_growth
  SavingOptions saving;
  Tolerances tolerances;
};

/// Collective. The names of the files to write, for a task of its own.
PetscErrorCode read_file_options(MPI_Comm comm, OutputSettings* settings);

/// Collective. Options of the program itself, which were obeyed before.
PetscErrorCode read_program_options(MPI_Comm comm);

/// What a run does after its start, on which depends what options it has.
enum class Steps { none, loads, time };

/// Collective. Reads those that such a run has; ends it with exit code 2 if they contradict each other.
PetscErrorCode read_run_options(MPI_Comm comm, Steps steps, RunOptions* out);

/// Collective. Reserves the run's files until `locks` is destroyed. Ends the run with exit code 2 if that fails.
PetscErrorCode lock_outputs(MPI_Comm comm, const RunOptions& options, OutputLocks* locks);

/// Collective. When the run begins to compute: removes the report and the matrices that an earlier run left under the claimed names and
/// -bs_overwrite lets go, so that they are not taken for those of this one, however it ends. Once; later calls do nothing.
PetscErrorCode remove_earlier_results(MPI_Comm comm);

}  // namespace bs
