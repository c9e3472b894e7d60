// What a task computes at the last state of a run, for its report, its trajectory and its summary.
#pragma once
#include <string>
#include <vector>
#include "output/report.hpp"
#include "systems/system.hpp"

namespace bs {

struct FinalResults {
  std::string failure;             ///< why nothing could be computed; empty where it was
  std::vector<Dataset> tables;     ///< of the trajectory, which has them already, without values
  Report report;                   ///< entries of the report
  std::vector<std::string> lines;  ///< of the summary
};

}  // namespace bs
