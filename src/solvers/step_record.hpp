// One good step, as the log of steps holds it, and why attempts at it were rejected: the one list of reasons, as files, report, summary and messages
// name them.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace bs {

struct RejectionReason {
  const char* key;       ///< after "rejected_" in the log of steps, the report and checkpoints
  const char* word;      ///< after a number, in the progress line and the summary
  const char* sentence;  ///< what happened
  const char* advice;    ///< what to try against it
};

enum Rejection : std::size_t { NEWTON, LINE_SEARCH, ITERATIONS, LINEAR, DOMAIN_ERROR, ERROR_ESTIMATE };

inline constexpr const char* NEWTON_ADVICE =
    "try a smaller -ts_dt or -bs_step_min, -snes_linesearch_type l2, or a larger -snes_max_it; -snes_monitor shows more";

/// In the order of Rejection.
inline constexpr RejectionReason REJECTION_REASONS[] = {
    {"newton", "Newton diverged", "Newton's residual grew without bound", NEWTON_ADVICE},
    {"line_search", "line search", "the line search found no smaller residual", NEWTON_ADVICE},
    {"iterations", "Newton iterations", "Newton did not converge within -snes_max_it iterations", NEWTON_ADVICE},
    {"linear", "linear solver", "the linear solver failed",
     "try -pc_type lu, a larger -ksp_max_it, or a smaller -ts_dt; -ksp_converged_reason shows more"},
    {"domain", "no finite force", "a force was not finite", "try a smaller -ts_dt"},
    {"error", "error estimate", "the estimated error was above the tolerances",
     "try a larger -ts_rtol or -ts_atol (-bs_atol_x, -bs_atol_v), or a smaller -bs_step_min; -ts_adapt_monitor shows more"},
};

/// Rejected attempts by reason.
using RejectionCounts = std::array<std::int64_t, std::size(REJECTION_REASONS)>;

/// One row of /backspring/log.
struct StepRecord {
  std::int64_t step = 0;
  double time = 0, dt = 0;                            ///< [s]
  std::int64_t newton = 0, krylov = 0, rejected = 0;  ///< of this step alone
  RejectionCounts reasons{};                          ///< of its rejected attempts
};

}  // namespace bs
