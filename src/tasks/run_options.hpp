// What the options say of a run, and the files it may write.
#pragma once
#include "output/claim.hpp"
#include "output/settings.hpp"
#include "tasks/adviser.hpp"
#include "tasks/saving.hpp"
#include "time/stepper.hpp"
#include "time/tolerances.hpp"

namespace bs {

struct RunOptions {
  OutputSettings output;
  StepOptions step;
  bool advise = true;
  double energy_growth = 10;  ///< -bs_energy_growth
  SavingOptions saving;
  Tolerances tolerances;
};

/// Collective. Reads them; told (exit 2) where they contradict each other.
PetscErrorCode read_run_options(MPI_Comm comm, RunOptions* out);

/// Collective. The run's files become its own until `claim` goes. Told (exit 2) where that cannot be.
PetscErrorCode claim_files(MPI_Comm comm, const RunOptions& options, Claim* claim);

}  // namespace bs
