// One good step, as the log of steps holds it.
#pragma once
#include <cstdint>
#include "solvers/rejection_reasons.hpp"

namespace bs {

/// One row of /backspring/log.
struct StepRecord {
  std::int64_t step = 0;
  double time = 0, dt = 0;                            ///< [s]
  std::int64_t newton = 0, krylov = 0, rejected = 0;  ///< of this step alone
  RejectionCounts reasons{};                          ///< of its rejected attempts
};

}  // namespace bs
