// What falls due by wall-clock time [s]: checkpoints, and what waits in memory to be written.
#pragma once

namespace bs {

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
