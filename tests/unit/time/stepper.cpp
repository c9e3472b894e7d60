// Steps hit output times, are cut where a solve fails and grow back, and are counted; what cannot go on ends with its reason.
#include "time/stepper.hpp"
#include <cmath>
#include <limits>
#include "options.hpp"
#include "small_model.hpp"

using namespace bs;

namespace {

/// y' = 1; without a value where y is in a forbidden band and steps are long.
class Clock final : public SmallModel {
 public:
  Clock() : SmallModel({0}) {}
  std::vector<double> rates(double t, const std::vector<double>&) const override { return {t > fails_at ? NAN : 1.0}; }
  std::vector<double> slopes(double, const std::vector<double>&) const override { return {0}; }
  PetscErrorCode accept(const Step& step, Vec) override {
    accepted.push_back(step.t);
    return 0;
  }
  bool time_dependent() const override { return true; }
  double fails_at = std::numeric_limits<double>::infinity();
  std::vector<double> accepted;
};

struct Steps {
  Clock model;
  TSContext context;
  TSHandle ts;
  std::unique_ptr<Stepper> stepper;
  std::vector<StepRecord> records;
  std::vector<double> frames;
  int saves = 0;

  Steps(const StepOptions& options, OptionTexts texts) {
    texts.insert({{"-ts_type", "beuler"}, {"-ts_adapt_type", "none"}, {"-ts_dt", "0.1"}, {"-ts_max_time", "1"}});
    const Given given(texts);
    REQUIRE(create_ts(model, &context, &ts) == 0);
    stepper = std::make_unique<Stepper>(
        model, context, options,
        [this](const StepRecord& record) {
          records.push_back(record);
          return 0;
        },
        [this](PetscInt, double time, Vec) {
          frames.push_back(time);
          return 0;
        },
        [] { return 0; },
        [this] {
          ++saves;
          return 0;
        });
    REQUIRE(stepper->attach(ts) == 0);
    REQUIRE(TSSetUp(ts) == 0);
    REQUIRE(stepper->attach_solvers(ts) == 0);
  }
  TSConvergedReason solve() {
    TSConvergedReason reason = TS_CONVERGED_ITERATING;
    REQUIRE(TSSolve(ts, nullptr) == 0);
    REQUIRE(TSGetConvergedReason(ts, &reason) == 0);
    return reason;
  }
};

}  // namespace

TEST_CASE("output times are hit exactly, by steps that are shortened and then nominal again") {
  StepOptions options;
  options.output_interval = 0.25;
  options.save_every = 5;
  Steps run(options, {});
  REQUIRE(run.solve() > 0);
  REQUIRE(run.frames == std::vector<double>{0.25, 0.5, 0.75, 1});
  double time = 0;
  std::int64_t number = 0, shortened = 0;
  for (const StepRecord& record : run.records) {
    CHECK(record.step == ++number);
    CHECK(record.dt <= 0.1 * (1 + 1e-12));
    CHECK(record.time == Approx(time + record.dt).epsilon(1e-14));
    CHECK(record.newton >= 1);
    CHECK(record.rejected == 0);
    shortened += record.dt < 0.1 * (1 - 1e-9);
    time = record.time;
  }
  CHECK(time == 1);
  CHECK(run.stepper->counts().steps == number);
  CHECK(run.stepper->counts().shortened == shortened);
  CHECK(run.saves == number / 5);
  CHECK(run.model.accepted.size() == run.records.size());
  CHECK(run.model.accepted.back() == 1);
  CHECK(run.stepper->nominal_step() == 0.1);
  CHECK(run.stepper->good_time() == 1);
  CHECK(run.stepper->framed());
  CHECK(run.stepper->trouble().empty());
  CHECK(run.stepper->shortest_cut() == 0);
}

TEST_CASE("a step beyond which there is no value is cut until the limit of rejections, and the run ends at the last good state") {
  StepOptions options;
  options.max_cuts = 3;
  options.length.cut = 0.5;
  Steps run(options, {});
  run.model.fails_at = 0.45;
  REQUIRE(run.solve() < 0);
  CHECK(run.stepper->good_time() <= 0.45);
  CHECK(run.stepper->good_time() > 0.39);
  CHECK(run.stepper->counts().rejected >= 3);
  CHECK(run.records.back().time == run.stepper->good_time());
  CHECK(run.model.accepted.back() == run.stepper->good_time());
  CHECK(run.stepper->rejections().counts()[DOMAIN_ERROR] > 0);
  CHECK(run.stepper->shortest_cut() < 0.1);
}

TEST_CASE("a task that gives the run up ends it after the present step") {
  Steps run({}, {});
  run.stepper->give_up("enough");
  REQUIRE(run.solve() < 0);
  CHECK(run.stepper->ending() == "enough");
  CHECK(run.records.size() <= 1);
}
