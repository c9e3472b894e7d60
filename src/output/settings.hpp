// The options of output/.
#pragma once
#include <string>

#include "output/trajectory.hpp"

namespace bs {

struct OutputSettings {
  TrajectoryOptions trajectory;
  double interval = 0;           ///< -bs_output_interval: simulated time between frames [s]; 0: every step
  std::string report;            ///< -bs_report: file of the closing report; empty: none
  double progress_interval = 5;  ///< -bs_progress_interval [s]
};

/// Collective. Reads the options; Claim checks whether the files can be written.
PetscErrorCode read_output_settings(MPI_Comm comm, OutputSettings* settings);

}  // namespace bs
