#include "time/stepping/step_length.hpp"
#include <algorithm>
#include <cmath>
#include "base/rounding.hpp"
#include "base/text.hpp"

namespace bs {

namespace {

constexpr double SAME = SAME_STEP;
constexpr double BLIND = 1e-3;        // length of a step without error estimate, of the nominal one
constexpr std::int64_t LONGEST = 32;  // times grow_after: good steps before a length that failed again and again is tried once more

}  // namespace

double StepLength::start_length() const { return rules_.first > 0 ? rules_.first : BLIND * nominal_; }

double StepLength::first_attempt() const { return blind_ || rules_.first > 0 ? std::min(start_length(), nominal_) : nominal_; }

void StepLength::plan(double time, double target, double proposed, bool fresh) {
  wanted_ = proposed;
  // without an estimate a method starts where nothing can go wrong unseen
  if (fresh && (blind_ || rules_.first > 0)) wanted_ = std::min(proposed, start_length());
  else if (adaptive_) wanted_ = std::max(proposed, rules_.least);
  target_ = target;
  planned_ = wanted_;
  const double rest = target - time, slack = time_rounding(target);
  landing_ = wanted_ >= rest * (1 - SAME) - slack;
  if (landing_ && wanted_ > rest * (1 + SAME) + slack) planned_ = rest;
  // two middling steps rather than a full one and a sliver, where the step is free
  else if (adaptive_ && !landing_ && wanted_ > 0.5 * rest * (1 + SAME)) planned_ = 0.5 * rest;
  if (first_planned_ == 0) first_planned_ = planned_;
}

bool StepLength::shortened() const { return landing_ && planned_ < nominal_ * (1 - SAME) && !adaptive_ && wanted_ >= nominal_ * (1 - SAME); }

bool StepLength::has_landed(double time) const { return landing_ && std::abs(time - target_) <= std::max(SAME * planned_, time_rounding(target_)); }

double StepLength::end_of_step(double time, double anchor) const {
  if (has_landed(time)) return target_;
  const double whole = adaptive_ ? NAN : decimal_time(anchor + std::round((time - anchor) / nominal_) * nominal_);
  return std::abs(whole - time) <= std::max(time_rounding(time), time_rounding(anchor)) ? whole : time;
}

double StepLength::recorded(double taken) const { return std::abs(taken - planned_) <= SAME * planned_ ? planned_ : taken; }

void StepLength::follow(double taken, bool landed, bool rejected, double proposed) {
  if (rejected) good_in_a_row_ = 0;
  if (rejected && !adaptive_ && planned_ > 0) {
    const double cut = wanted_ * (taken / planned_);  // but for output times
    shortest_cut_ = shortest_cut_ > 0 ? std::min(shortest_cut_, cut) : cut;
  }
  // a length that fails as soon as it is tried again costs an attempt each time: it is tried ever less often
  if (grown_from_ > 0 && planned_ > grown_from_ * (1 + SAME)) {
    if (rejected) awaited_ = std::min(2 * awaited_, LONGEST * rules_.grow_after);
    grown_from_ = 0;
  }
  if (!adaptive_) next_ = grown_back(taken);
  else next_ = landed && taken < wanted_ ? std::max(proposed, wanted_) : proposed;
}

double StepLength::grown_back(double taken) {
  const double next = taken < planned_ * (1 - SAME) ? taken : wanted_;
  const bool whole = next >= nominal_ * (1 - SAME);
  if (++good_in_a_row_ < awaited_) return whole ? nominal_ : next;
  good_in_a_row_ = 0;
  if (whole) {
    awaited_ = std::max(awaited_ / 2, rules_.grow_after);
    return nominal_;
  }
  grown_from_ = next;
  return std::min(nominal_, next / rules_.cut);
}

void StepLength::save(Facts* facts) const {
  facts->real["nominal_step"] = nominal_;
  facts->real["next_step"] = next_;
  facts->real["first_step"] = first_planned_;
  facts->whole["good_in_a_row"] = good_in_a_row_;
  facts->whole["good_awaited"] = awaited_;
  facts->real["grown_from"] = grown_from_;
  facts->real["shortest_cut"] = shortest_cut_;
}

std::string StepLength::restore(const Facts& facts) {
  const double was = facts.real.at("nominal_step");
  first_planned_ = facts.real.at("first_step");
  shortest_cut_ = facts.real_of("shortest_cut", shortest_cut_);
  good_in_a_row_ = facts.whole.at("good_in_a_row");
  const bool same = std::abs(was - nominal_) <= 1e-14 * nominal_;
  next_ = same ? facts.real.at("next_step") : nominal_;
  if (same && facts.whole.count("good_awaited")) awaited_ = std::max(facts.whole.at("good_awaited"), rules_.grow_after);
  if (same) grown_from_ = facts.real_of("grown_from", grown_from_);
  return same ? std::string() : format("the step is -ts_dt %g; it was %g", nominal_, was);
}

double OutputClock::next(double time) const {
  if (interval_ <= 0) return end_;
  double next = output_time(frame_);
  // k*interval may lie a rounding error before the end
  if (next > end_ || std::abs(next - end_) <= SAME_STEP * interval_) next = end_;
  return std::max(next, time);
}

void OutputClock::pass(double time) {
  if (interval_ <= 0 || output_time(frame_) - time <= SAME_STEP * interval_) ++frame_;
}

void OutputClock::restore(const Facts& facts, double time) {
  start_ = facts.real.at("start");
  if (interval_ > 0) frame_ = static_cast<std::int64_t>(std::floor((time - start_) / interval_ * (1 + 1e-14) + 1e-9)) + 1;
}

std::string lost_in_rounding(double t, double h, double interval, double least) {
  if (h >= least && (interval <= 0 || interval >= least)) return {};
  const bool step = h < least;
  return format("%s %g s is lost in the rounding of t = %.10g s, beside which %g s is the least that counts: ",
                step ? "a step of" : "option -bs_output_interval:", step ? h : interval, t, least) +
         "let the time start at 0 (-ts_init_time), or give a larger one";
}

std::string endless(double steps) {
  constexpr double MOST = 2147483647;  // that a 32-bit count of steps holds
  if (!(steps > MOST)) return {};
  return format("the run would take %.3g steps, more than %.0f: give a larger -ts_dt, a smaller -ts_max_time, or -ts_max_steps", steps, MOST);
}

}  // namespace bs
