// Output times, and how long the next step is: the nominal length, shortened to land on one, cut after a rejection and grown back.
#pragma once
#include <cstdint>
#include <string>
#include "base/facts.hpp"
#include "base/rounding.hpp"

namespace bs {

struct StepRules {
  double cut = 0.25;            ///< -bs_step_cut: factor on h after a failed solve
  std::int64_t grow_after = 3;  ///< -bs_step_grow_after: good steps before h grows back
  double least = 0;             ///< -bs_step_min [s]: no attempt below it; 0: only -bs_step_max_cuts ends them
  double first = 0;             ///< -bs_step_first [s]; 0: chosen
};

/// One step is planned by plan(); the method may take less of it, after rejections; follow() then says what comes next.
class StepLength {
 public:
  StepLength() = default;
  /// `adaptive`: the method chooses its steps by an error estimate; `blind`: it has no estimate of its first step.
  StepLength(const StepRules& rules, double nominal, bool adaptive, bool blind)
      : rules_(rules), nominal_(nominal), wanted_(nominal), next_(nominal), adaptive_(adaptive), blind_(blind) {}
  double nominal() const { return nominal_; }
  double next() const { return next_; }
  /// Whether an error estimate chooses it.
  bool adaptive() const { return adaptive_; }
  /// Of the very first attempt, but for output times [s].
  double first_attempt() const;
  /// The step from `time` to `target`, at most: the next output time, or a time before it. `proposed`: the method's own choice; `fresh`: the method
  /// has no step behind it. One that would pass the target is shortened; one that would miss it by rounding is kept.
  void plan(double time, double target, double proposed, bool fresh);
  double planned() const { return planned_; }
  double target() const { return target_; }
  /// Whether the planned step of a constant length is shorter only to land.
  bool shortened() const;
  /// Whether the good step that ended at `time` has landed on the target, up to rounding.
  bool has_landed(double time) const;
  /// The time at which a good step has ended that TS has end at `time`: the target where it has landed there; otherwise so many whole steps after
  /// the output time `anchor`, which no sum of roundings has moved, where steps are constant.
  double end_of_step(double time, double anchor) const;
  /// The length to be recorded for a step whose ends are `taken` apart: the planned one, but for rounding.
  double recorded(double taken) const;
  /// After a good step of length `taken`; `rejected`: attempts at it were; `proposed`: the method's choice for the next one. The
  /// length from before a landing comes back; after cuts it grows by 1/cut every few good steps, of
  /// which twice as many are awaited where the first step after a growth was rejected.
  void follow(double taken, bool landed, bool rejected, double proposed);
  /// What the nominal length was cut to, at the least, by rejections of steps without an error estimate; 0: it never was.
  double shortest_cut() const { return shortest_cut_; }
  /// What comes next begins as a run does: with the nominal length at most.
  void begin_anew() { next_ = next_ < nominal_ ? next_ : nominal_; }
  void save(Facts* facts) const;
  /// Returns what is not as it was, in words.
  std::string restore(const Facts& facts);

 private:
  double start_length() const;
  double grown_back(double taken);

  StepRules rules_;
  double nominal_ = 0;               ///< -ts_dt
  double wanted_ = 0;                ///< of the present step, if no output time were in its way
  double planned_ = 0, target_ = 0;  ///< the present step's length, and the output time ahead of it
  double next_ = 0;                  ///< of the step after the last good one
  double first_planned_ = 0;         ///< of the run's first step; 0: there was none yet
  bool adaptive_ = false, blind_ = false;
  double shortest_cut_ = 0;
  bool landing_ = false;                      ///< the present step ends at the target
  double grown_from_ = 0;                     ///< length before the last growth, as long as none longer has been tried; 0: one has
  std::int64_t good_in_a_row_ = 0;            ///< good steps since a rejection, or since the last growth
  std::int64_t awaited_ = rules_.grow_after;  ///< good steps before the length grows
};

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
  /// Length of the present one [s].
  double length() const { return present_; }
  /// Length of the last one that was rejected [s].
  double last_rejected() const { return rejected_; }

 private:
  double least_ = 0, present_ = 0, rejected_ = 0;
  double resolution_ = 0;  ///< a shorter attempt does not change the time it starts at [s]
  std::int64_t most_ = 0, in_a_row_ = 0;
};

// Output times: start + k interval, k = 1, 2, ..., and the end of the run.

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
  /// The one before it, or the start.
  double previous() const { return output_time(frame_ - 1); }
  /// A step has landed at `time`: on the output time that was due next, or on an end before it.
  void pass(double time);
  bool is_end(double target) const { return target >= end_; }
  void save(Facts* facts) const { facts->real["start"] = start_; }
  /// Of a run that goes on at `time`: the first output time after it is due next.
  void restore(const Facts& facts, double time);

 private:
  double output_time(std::int64_t k) const { return decimal_time(start_ + static_cast<double>(k) * interval_); }

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

/// What to say where steps of h, or output times every `interval` (0: none), are shorter than the `least` that counts beside t
/// [s]; empty where they are not.
std::string lost_in_rounding(double t, double h, double interval, double least);

/// What to say of a run of so many steps, where it would never end; empty: it would.
std::string endless(double steps);

}  // namespace bs
