// What falls due by wall-clock time [s]: checkpoints, and the log of steps that waits in memory.
#pragma once

namespace bs {

class WallSchedule {
 public:
  WallSchedule() = default;
  /// Checkpoints every `save_minutes` (0: none), from `now` on.
  WallSchedule(double save_minutes, double now) : save_minutes_(save_minutes), saved_at_(now), logged_at_(now) {}
  bool save_due(double now) const { return save_minutes_ > 0 && now - saved_at_ >= 60 * save_minutes_; }
  bool log_due(double now) const { return now - logged_at_ >= LOG_SECONDS; }
  void saved(double now) { saved_at_ = now; }
  void logged(double now) { logged_at_ = now; }

 private:
  static constexpr double LOG_SECONDS = 10;
  double save_minutes_ = 0, saved_at_ = 0, logged_at_ = 0;
};

}  // namespace bs
