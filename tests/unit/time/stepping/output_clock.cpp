// Output times, what rounding leaves of them, and what falls due by the wall clock.
#include <catch2/catch.hpp>

#include "base/rounding.hpp"
#include "time/stepping/step_length.hpp"

using namespace bs;

TEST_CASE("output times are start + k interval, and the end") {
  OutputClock clock(2.0, 3.0, 0.3);
  REQUIRE(clock.next(2.0) == 2.0 + 0.3);
  REQUIRE(clock.next(2.29) == 2.0 + 0.3);
  clock.pass(2.0 + 0.3);
  REQUIRE(clock.next(2.3) == 2.0 + 2 * 0.3);
  clock.pass(2.0 + 2 * 0.3);
  clock.pass(2.0 + 3 * 0.3);
  REQUIRE(clock.next(2.9) == 3.0);  // 3.2 is past it
  REQUIRE(clock.is_end(3.0));
  REQUIRE_FALSE(clock.is_end(2.9));
}

TEST_CASE("an output time that is past is now") {
  const OutputClock clock(0.0, 10.0, 1.0);
  REQUIRE(clock.next(1.5) == 1.5);
}

TEST_CASE("without an interval the end is the only output time") {
  const OutputClock clock(1.0, 7.5, 0.0);
  REQUIRE(clock.next(1.0) == 7.5);
  REQUIRE(clock.next(7.0) == 7.5);
}

TEST_CASE("an output time that misses the end by rounding is the end") {
  // 10 * 0.1 added up from 0 is below 1, 3 * 0.1 above 0.3: either way the end itself is the last output time
  for (const auto& [end, count] : {std::pair<double, int>{1.0, 10}, {0.3, 3}, {0.7, 7}}) {
    OutputClock clock(0.0, end, 0.1);
    for (int k = 1; k < count; ++k) clock.pass(clock.next(0.0));
    REQUIRE(clock.next(0.0) == end);
    REQUIRE(clock.is_end(clock.next(0.0)));
  }
}

TEST_CASE("an end that moves on takes no output time with it") {
  OutputClock clock(0.0, 0.55, 0.2);
  for (const double time : {0.2, 0.4}) {
    REQUIRE(clock.next(time - 0.1) == Approx(time).epsilon(1e-15));
    clock.pass(clock.next(time - 0.1));
  }
  for (const double end : {0.55, 0.58}) {
    clock.set_end(end);
    REQUIRE(clock.next(0.5) == end);
    clock.pass(end);
  }
  clock.set_end(2.0);
  REQUIRE(clock.next(0.58) == 0.6);
}

TEST_CASE("a continued clock goes on with the first output time after now") {
  Facts facts;
  OutputClock(0.5, 2.0, 0.1).save(&facts);
  for (int done = 0; done < 14; ++done) {
    OutputClock clock(99.0, 2.0, 0.1);  // its start is the one of the checkpoint
    const double now = 0.5 + done * 0.1;
    clock.restore(facts, now);
    REQUIRE(clock.start() == 0.5);
    REQUIRE(clock.next(now) == (6 + done) / 10.0);
    clock.restore(facts, now + 0.04);
    REQUIRE(clock.next(now + 0.04) == (6 + done) / 10.0);
  }
}

TEST_CASE("steps and intervals that rounding swallows are told apart") {
  REQUIRE(lost_in_rounding(0.0, 1e-300, 0.0, time_resolution(0.0)).empty());
  REQUIRE(lost_in_rounding(1.0, 1e-12, 0.0, time_resolution(1.0)).empty());
  const std::string step = lost_in_rounding(1e9, 1e-7, 1.0, time_resolution(1e9));
  REQUIRE(step.find("a step of 1e-07 s is lost in the rounding of t = 1000000000 s") == 0);
  const std::string interval = lost_in_rounding(1e9, 1.0, 1e-7, time_resolution(1e9));
  REQUIRE(interval.find("option -bs_output_interval: 1e-07 s is lost") == 0);
  REQUIRE(time_resolution(-3.0) == 3 * 1000 * 0x1p-52);
  REQUIRE(time_rounding(-3.0) == 3 * 4 * 0x1p-52);
}

TEST_CASE("attempts end by their length, by their number, and by the rounding of the time") {
  Attempts by_length(0.01, 100);
  by_length.begin(0.0, 0.04);
  REQUIRE_FALSE(by_length.spent(0.01));
  REQUIRE_FALSE(by_length.spent(0.01 * (1 - 1e-12)));
  REQUIRE(by_length.spent(0.009999));

  Attempts by_number(0.0, 3);
  by_number.begin(0.0, 1.0);
  for (int k = 0; k < 3; ++k) {
    by_number.reject();
    REQUIRE_FALSE(by_number.spent(1e-6));
    by_number.go_on(std::pow(0.25, k + 1));
  }
  by_number.reject();
  REQUIRE(by_number.spent(1e-6));
  REQUIRE(by_number.in_a_row() == 4);
  REQUIRE(by_number.last_rejected() == std::pow(0.25, 3));
  by_number.begin(0.1, 0.1);
  REQUIRE(by_number.in_a_row() == 0);

  Attempts by_time(0.0, 100);
  by_time.begin(1.0, 0.1);
  REQUIRE_FALSE(by_time.spent(4 * 0x1p-52));
  REQUIRE(by_time.spent(3.9 * 0x1p-52));
}

TEST_CASE("checkpoints and the log fall due by the wall clock") {
  WallSchedule schedule(2.0, 10.0, 1000.0);
  REQUIRE_FALSE(schedule.save_due(1119.9));
  REQUIRE(schedule.save_due(1120.0));
  schedule.saved(1120.0);
  REQUIRE_FALSE(schedule.save_due(1239.0));
  REQUIRE_FALSE(schedule.flush_due(1009.0));
  REQUIRE(schedule.flush_due(1010.0));
  schedule.flushed(1010.0);
  REQUIRE_FALSE(schedule.flush_due(1019.0));
  REQUIRE_FALSE(WallSchedule(0.0, 2.0, 0.0).save_due(1e9));
}
