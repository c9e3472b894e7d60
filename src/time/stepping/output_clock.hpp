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
  double end() const { return end_; }
  void set_end(double end) { end_ = end; }
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

class WallSchedule {
 public:
  WallSchedule() = default;
  /// Checkpoints every `save_minutes` (0: none), flushes every `flush_seconds`, but at most ten a second, from `now` on.
  WallSchedule(double save_minutes, double flush_seconds, double now)
      : save_minutes_(save_minutes),
        flush_seconds_(flush_seconds > LEAST_SECONDS ? flush_seconds : LEAST_SECONDS),
        saved_at_(now),
        flushed_at_(now) {}
  bool save_due(double now) const { return save_minutes_ > 0 && now - saved_at_ >= 60 * save_minutes_; }
  bool flush_due(double now) const { return now - flushed_at_ >= flush_seconds_; }
  void saved(double now) { saved_at_ = now; }
  void flushed(double now) { flushed_at_ = now; }

 private:
  static constexpr double LEAST_SECONDS = 0.1;
  double save_minutes_ = 0, flush_seconds_ = 2, saved_at_ = 0, flushed_at_ = 0;
};

}  // namespace bs
