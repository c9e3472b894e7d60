// What a run has done, step by step, over the runs it continues.
#pragma once
#include <cstdint>
#include "base/facts.hpp"
#include "solvers/step_record.hpp"

namespace bs {

/// What a run did, for the summary and the report.
struct RunCounts {
  std::int64_t steps = 0, rejected = 0, newton = 0, krylov = 0, shortened = 0;
};

std::int64_t total(const RejectionCounts& counts);

class StepCounter {
 public:
  const RunCounts& counts() const { return counts_; }
  void add_shortened() { ++counts_.shortened; }
  /// The run has come to step number `steps`.
  void set_steps(std::int64_t steps) { counts_.steps = steps; }
  /// Iterations of the solvers since they were made, and rejections since the run began: what is new goes into `record`.
  void count(std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected, StepRecord* record);
  void save(Facts* facts) const;
  /// `newton`, `krylov`: what the solvers have counted so far and is no step's; `rejected`: of the run.
  void restore(const Facts& facts, std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected);

 private:
  RunCounts counts_;
  RejectionCounts rejected_{};                          ///< by reason, at the last count
  std::int64_t newton_before_ = 0, krylov_before_ = 0;  ///< to be added to what the solvers count
};

}  // namespace bs
