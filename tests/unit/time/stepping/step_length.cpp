// The length of the next step: landing, cuts, growing back, free steps, a continued run.
#include <catch2/catch.hpp>

#include "time/stepping/step_length.hpp"

using namespace bs;

namespace {

constexpr bool ADAPTIVE = true, BLIND = true;

/// A run of good steps to `end`, each of the length that was planned; `propose` is the method's choice for the next one. Every output
/// time must be landed on, and no step may pass one.
template <class Propose>
std::vector<double> lengths_to(double end, double interval, StepLength length, Propose propose) {
  OutputClock clock(0.0, end, interval);
  std::vector<double> taken;
  double time = 0, next = length.next();
  for (bool done = false; !done && taken.size() < 10000;) {
    const double target = clock.next(time);
    length.plan(time, target, next, taken.empty());
    const double before = time;
    time += length.planned();
    REQUIRE(time <= target * (1 + 1e-14));
    const bool landed = length.has_landed(time);
    if (landed) time = target;
    taken.push_back(length.planned());
    length.follow(time - before, landed, false, propose(length.planned()));
    next = length.next();
    done = landed && clock.is_end(time);
    if (landed) clock.pass(time);
  }
  REQUIRE(time == end);
  return taken;
}

double keep(double h) { return h; }

/// A nominal length of 0.1 whose first attempts were rejected, down to `first`.
StepLength cut_to(double first, std::int64_t grow_after) {
  StepRules rules;
  rules.cut = 0.25;
  rules.grow_after = grow_after;
  StepLength length(rules, 0.1, false, false);
  length.plan(0.0, 100.0, 0.1, true);
  length.follow(first, false, true, first);
  return length;
}

/// A good step of the length that is next.
void take(StepLength* length) {
  length->plan(1.0, 100.0, length->next(), false);
  length->follow(length->planned(), false, false, length->planned());
}

/// The same, of which `taken` is left after rejections.
void take_cut(StepLength* length, double taken) {
  length->plan(1.0, 100.0, length->next(), false);
  length->follow(taken, false, true, taken);
}

}  // namespace

TEST_CASE("a constant step lands on every output time and comes back after it") {
  const std::vector<double> h = lengths_to(0.5, 0.25, StepLength({}, 0.1, false, false), keep);
  REQUIRE(h.size() == 6);
  for (std::size_t k : {0u, 1u, 3u, 4u}) REQUIRE(h[k] == 0.1);
  for (std::size_t k : {2u, 5u}) REQUIRE(h[k] == Approx(0.05).epsilon(1e-12));
}

TEST_CASE("a step that would miss an output time by rounding is kept") {
  const std::vector<double> h = lengths_to(1.0, 0.3, StepLength({}, 0.1, false, false), keep);  // 3 * 0.1 != 0.3
  REQUIRE(h.size() == 10);
  for (double one : h) REQUIRE(one == 0.1);
}

TEST_CASE("only steps shortened to land count as shortened") {
  StepLength length({}, 0.1, false, false);
  length.plan(0.0, 0.25, 0.1, true);
  REQUIRE_FALSE(length.shortened());
  length.plan(0.2, 0.25, 0.1, false);
  REQUIRE(length.shortened());
  REQUIRE(length.target() == 0.25);
  length.plan(0.2, 0.25, 0.025, false);  // after a cut
  REQUIRE_FALSE(length.shortened());
  StepLength free({}, 0.1, ADAPTIVE, false);
  free.plan(0.2, 0.25, 0.1, false);
  REQUIRE(free.planned() == Approx(0.05));
  REQUIRE_FALSE(free.shortened());
}

TEST_CASE("free steps share what is left before an output time") {
  StepLength length({}, 0.1, ADAPTIVE, false);
  length.plan(0.0, 1.0, 0.7, false);
  REQUIRE(length.planned() == 0.5);
  REQUIRE_FALSE(length.has_landed(0.5));
  length.plan(0.0, 1.0, 0.5, false);  // half of it is no reason
  REQUIRE(length.planned() == 0.5);
  length.plan(0.0, 1.0, 0.3, false);
  REQUIRE(length.planned() == 0.3);
  StepLength constant({}, 0.7, false, false);
  constant.plan(0.0, 1.0, 0.7, false);
  REQUIRE(constant.planned() == 0.7);
}

TEST_CASE("a free step shortened to land comes back, unless the method wants more") {
  StepLength length({}, 0.1, ADAPTIVE, false);
  length.plan(0.9, 1.0, 0.4, false);
  REQUIRE(length.has_landed(1.0));
  length.follow(0.1, true, false, 0.2);
  REQUIRE(length.next() == 0.4);
  length.plan(0.9, 1.0, 0.4, false);
  length.follow(0.1, true, false, 0.5);
  REQUIRE(length.next() == 0.5);
  length.plan(0.0, 1.0, 0.4, false);  // not landing: the method's choice
  length.follow(0.4, false, false, 0.2);
  REQUIRE(length.next() == 0.2);
}

TEST_CASE("a cut step grows back by 1/cut after so many good ones") {
  StepLength length = cut_to(0.1 / 16, 3);  // two rejections: this is the first good step
  REQUIRE(length.next() == 0.1 / 16);
  std::vector<double> after;
  for (int k = 0; k < 6; ++k) {
    take(&length);
    after.push_back(length.next());
  }
  REQUIRE(after == std::vector<double>{0.1 / 16, 0.1 / 4, 0.1 / 4, 0.1 / 4, 0.1, 0.1});
}

TEST_CASE("a length that fails as soon as it is tried again is tried ever less often") {
  StepLength length = cut_to(0.025, 2);
  std::vector<int> awaited;
  for (int attempt = 0; attempt < 8; ++attempt) {
    int good = 1;
    for (; length.next() < 0.1; ++good) take(&length);
    awaited.push_back(good);
    length.plan(1.0, 1.02, length.next(), false);  // a step that is shortened to land says nothing of the length
    length.follow(length.planned(), true, false, length.planned());
    Facts facts;
    length.save(&facts);
    length = cut_to(0.025, 2);
    length.restore(facts);
    take_cut(&length, 0.025);  // the attempt at the whole length was rejected
  }
  REQUIRE(awaited == std::vector<int>{2, 4, 8, 16, 32, 64, 64, 64});
  for (int k = 0; k < 1000; ++k) take(&length);
  take_cut(&length, 0.025);
  take(&length);
  REQUIRE(length.next() == 0.1);  // the whole length has held for long
}

TEST_CASE("a rejection starts the count of good steps again") {
  StepLength length = cut_to(0.025, 2);
  REQUIRE(length.next() == 0.025);
  take_cut(&length, 0.025 / 4);  // rejected once more: the one good step is forgotten
  REQUIRE(length.next() == 0.025 / 4);
  take(&length);
  REQUIRE(length.next() == 0.025);
}

TEST_CASE("a method without an estimate of its first step begins with a thousandth") {
  StepLength blind({}, 0.1, ADAPTIVE, BLIND);
  REQUIRE(blind.first_attempt() == 1e-3 * 0.1);
  blind.plan(0.0, 1.0, 0.1, true);
  REQUIRE(blind.planned() == 1e-3 * 0.1);
  blind.plan(1e-4, 1.0, 0.1, false);
  REQUIRE(blind.planned() == 0.1);
  REQUIRE(StepLength({}, 0.1, false, false).first_attempt() == 0.1);
}

TEST_CASE("-bs_step_first and -bs_step_min bound the first and every other attempt") {
  StepRules rules;
  rules.first = 0.003;
  rules.least = 0.02;
  StepLength length(rules, 0.1, ADAPTIVE, BLIND);
  REQUIRE(length.first_attempt() == 0.003);
  length.plan(0.0, 10.0, 0.1, true);
  REQUIRE(length.planned() == 0.003);
  length.plan(0.003, 10.0, 0.001, false);  // the method asks for less than is allowed
  REQUIRE(length.planned() == 0.02);
  rules.first = 5;
  REQUIRE(StepLength(rules, 0.1, false, false).first_attempt() == 0.1);
}

TEST_CASE("the length recorded is the one planned, but for rounding") {
  StepLength length({}, 0.1, false, false);
  length.plan(1.0, 5.0, 0.1, false);
  REQUIRE(length.recorded(1.1 - 1.0) == 0.1);  // 1.1 - 1.0 is not 0.1
  REQUIRE(length.recorded(0.025) == 0.025);
}

TEST_CASE("a landing is a landing up to the rounding of a late time") {
  StepLength length({}, 1e-6, false, false);
  const double target = 1e6;
  length.plan(target - 1e-6, target, 1e-6, false);
  REQUIRE(length.has_landed(target - 1e-10));  // time itself is rounded to 1.2e-10 there
  REQUIRE_FALSE(length.has_landed(target - 1e-8));
}

TEST_CASE("the deepest cut is that of rejections, not of output times") {
  StepLength length(StepRules{}, 0.1, false, false);
  length.plan(0.0, 0.001, 0.1, true);  // shortened to land
  length.follow(0.001, true, false, 0.001);
  REQUIRE(length.shortest_cut() == 0);
  length.plan(0.001, 0.003, 0.1, false);  // and a quarter of that after a rejection
  length.follow(0.0005, false, true, 0.0005);
  REQUIRE(length.shortest_cut() == Approx(0.025));
}

TEST_CASE("a continued run goes on with the length it would have had") {
  StepRules rules;
  StepLength length(rules, 0.1, false, false);
  length.plan(0.0, 100.0, 0.1, true);
  length.follow(0.025, false, true, 0.025);
  length.plan(0.025, 100.0, length.next(), false);
  length.follow(0.025, false, false, 0.025);
  Facts facts;
  length.save(&facts);
  REQUIRE(facts.real == std::map<std::string, double>{
                            {"nominal_step", 0.1}, {"next_step", 0.025}, {"first_step", 0.1}, {"grown_from", 0}, {"shortest_cut", 0.025}});
  REQUIRE(facts.whole == std::map<std::string, std::int64_t>{{"good_in_a_row", 2}, {"good_awaited", 3}});

  StepLength again(rules, 0.1, false, false);
  REQUIRE(again.restore(facts).empty());
  REQUIRE(again.next() == 0.025);
  REQUIRE(again.shortest_cut() == 0.025);
  for (StepLength* one : {&length, &again}) {  // the third good step lets both grow back
    one->plan(0.05, 100.0, one->next(), false);
    one->follow(0.025, false, false, 0.025);
    REQUIRE(one->next() == 0.1);
  }
  for (const char* name : {"grown_from", "good_awaited"}) {  // unknown to checkpoints of earlier programs
    Facts old = facts;
    old.real.erase(name);
    old.whole.erase(name);
    REQUIRE(StepLength(rules, 0.1, false, false).restore(old).empty());
  }
  Facts later;
  again.save(&later);
  REQUIRE(later.real.at("first_step") == 0.1);  // of the run, not of its continuation

  StepLength other(rules, 0.05, false, false);
  REQUIRE(other.restore(facts) == "the step is -ts_dt 0.05; it was 0.1");
  REQUIRE(other.next() == 0.05);
}
