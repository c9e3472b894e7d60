// When the attempts at one step end: by -bs_step_min, -bs_step_max_cuts, or the rounding of the time.
#pragma once
#include <cstdint>
#include "base/rounding.hpp"

namespace bs {

class Attempts {
 public:
  Attempts() = default;
  /// None is made below `least` [s], nor after more than `most` rejections of one step.
  Attempts(double least, std::int64_t most) : least_(least), most_(most) {}
  /// Before a step of length h from time t.
  void begin(double t, double h) {
    in_a_row_ = 0;
    present_ = h;
    resolution_ = time_rounding(t);
  }
  /// The same step goes on with length h.
  void go_on(double h) { present_ = h; }
  void reject() {
    rejected_ = present_;
    ++in_a_row_;
  }
  /// Whether no attempt of length `next` is to follow.
  bool spent(double next) const { return next < least_ * (1 - SAME_STEP) || next < resolution_ || in_a_row_ > most_; }
  std::int64_t in_a_row() const { return in_a_row_; }
  /// Length of the last one that was rejected [s].
  double last_rejected() const { return rejected_; }

 private:
  double least_ = 0, present_ = 0, rejected_ = 0;
  double resolution_ = 0;  ///< a shorter attempt does not change the time it starts at [s]
  std::int64_t most_ = 0, in_a_row_ = 0;
};

}  // namespace bs
