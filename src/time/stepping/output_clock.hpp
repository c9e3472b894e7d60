// Output times: start + k interval, k = 1, 2, ..., and the end of the run.
#pragma once
#include <cstdint>
#include "base/facts.hpp"

namespace bs {

class OutputClock {
 public:
  OutputClock() = default;
  /// `interval` 0: there is no output time but the end. All in [s].
  OutputClock(double start, double end, double interval) : start_(start), end_(end), interval_(interval) {}
  double start() const { return start_; }
  double interval() const { return interval_; }
  /// The output time that is due next; `time` itself where it is past that.
  double next(double time) const;
  /// The output time that was due next is reached.
  void pass() { ++frame_; }
  bool is_end(double target) const { return target >= end_; }
  void save(Facts* facts) const { facts->real["start"] = start_; }
  /// Of a run that goes on at `time`: the first output time after it is due next.
  void restore(const Facts& facts, double time);

 private:
  double start_ = 0, end_ = 0, interval_ = 0;
  std::int64_t frame_ = 1;  ///< k of the output time that is due next
};

}  // namespace bs
