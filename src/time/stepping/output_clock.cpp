#include "time/stepping/output_clock.hpp"
#include <algorithm>
#include <cmath>
#include "base/rounding.hpp"

namespace bs {

double OutputClock::next(double time) const {
  if (interval_ <= 0) return end_;
  double next = start_ + static_cast<double>(frame_) * interval_;
  // k*interval may lie a rounding error before the end
  if (next > end_ || std::abs(next - end_) <= SAME_STEP * interval_) next = end_;
  return std::max(next, time);
}

void OutputClock::restore(const Facts& facts, double time) {
  start_ = facts.real.at("start");
  if (interval_ > 0) frame_ = static_cast<std::int64_t>(std::floor((time - start_) / interval_ * (1 + 1e-14) + 1e-9)) + 1;
}

}  // namespace bs
