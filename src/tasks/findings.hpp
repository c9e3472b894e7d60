// What a task computes at the last state of a run, for its report, its trajectory and its summary.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "output/report.hpp"
#include "systems/system.hpp"

namespace bs {

struct Findings {
  std::string why;                                                                 ///< nothing could be computed; empty where it was
  std::vector<Dataset> tables;                                                     ///< of the trajectory, which has them already, without values
  std::vector<std::pair<std::string, Report>> entries;                             ///< of the report
  std::vector<std::pair<std::string, std::vector<std::vector<double>>>> matrices;  ///< likewise, by rows
  std::vector<std::pair<std::string, std::int64_t>> counts;                        ///< likewise
  std::vector<std::string> lines;                                                  ///< of the summary
};

}  // namespace bs
