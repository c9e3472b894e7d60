// What a method remembers of earlier steps, and that a new TS is given the same memory.
#include "time/history.hpp"
#include <unistd.h>
#include <cmath>
#include "options.hpp"
#include "small_model.hpp"
#include "spoken.hpp"
#include "time/ts_setup.hpp"

using namespace bs;

namespace {

/// y' = -y^2 + cos t, z' = -2 z
class Pair final : public SmallModel {
 public:
  Pair() : SmallModel({1, 0.5}) {}
  std::vector<double> rates(double t, const std::vector<double>& y) const override { return {-y[0] * y[0] + std::cos(t), -2 * y[1]}; }
  std::vector<double> slopes(double, const std::vector<double>& y) const override { return {-2 * y[0], 0, 0, -2}; }
};

/// A TS whose history is kept as Stepper keeps it.
struct Kept {
  Pair model;
  TSContext context;
  TSHandle ts;
  History history;

  explicit Kept(const OptionTexts& texts) {
    OptionTexts all = texts;
    all.insert({{"-snes_rtol", "1e-13"}, {"-ts_adapt_type", "none"}, {"-ts_max_time", "100"}});
    const Given given(all);
    REQUIRE(create_ts(model, &context, &ts) == 0);
    REQUIRE(TSSetApplicationContext(ts, &history) == 0);
    REQUIRE(TSSetPreStage(ts, before) == 0);
    REQUIRE(TSSetPostStage(ts, after) == 0);
    REQUIRE(history.attach(ts) == 0);
    REQUIRE(TSSetUp(ts) == 0);
  }
  static PetscErrorCode before(TS ts, PetscReal time) {
    History* self = nullptr;
    PetscFunctionBegin;
    PetscCall(TSGetApplicationContext(ts, &self));
    self->before_stage(time);
    PetscFunctionReturn(0);
  }
  static PetscErrorCode after(TS ts, PetscReal time, PetscInt index, Vec* stages) {
    History* self = nullptr;
    PetscFunctionBegin;
    PetscCall(TSGetApplicationContext(ts, &self));
    PetscCall(self->record_stage(ts, time, stages[index]));
    PetscFunctionReturn(0);
  }
  void step(double h) {
    REQUIRE(TSSetTimeStep(ts, h) == 0);
    REQUIRE(history.begin_step(ts) == 0);
    REQUIRE(TSStep(ts) == 0);
    REQUIRE(history.end_step(ts) == 0);
  }
  Vec state() {
    Vec y = nullptr;
    REQUIRE(TSGetSolution(ts, &y) == 0);
    return y;
  }
  std::vector<double> numbers() { return SmallModel::get(state()); }
  double time() {
    PetscReal t = 0;
    REQUIRE(TSGetTime(ts, &t) == 0);
    return t;
  }
};

}  // namespace

TEST_CASE("the state before the last is that of the last good step, not of an attempt that is repeated") {
  Kept run(OptionTexts{{"-ts_type", "beuler"}});
  double h = 0;
  CHECK(run.history.before_last(&h) == nullptr);
  run.step(0.1);
  CHECK(run.history.steps() == 1);
  const std::vector<double> first = run.numbers();
  run.step(0.2);
  const std::vector<double> second = run.numbers();
  REQUIRE(TSSetTimeStep(run.ts, 0.4) == 0);
  REQUIRE(run.history.begin_step(run.ts) == 0);
  REQUIRE(TSSetTimeStep(run.ts, 0.05) == 0);
  REQUIRE(run.history.begin_step(run.ts) == 0);  // once more, shorter
  Vec before = run.history.before_last(&h);
  REQUIRE(before != nullptr);
  CHECK(SmallModel::get(before) == first);
  CHECK(h == 0.2);
  CHECK(SmallModel::get(run.history.last_start()) == second);
}

TEST_CASE("a new TS that is given the history goes on as the old one") {
  for (const OptionTexts& texts : {OptionTexts{{"-ts_type", "bdf"}, {"-ts_bdf_order", "2"}}, OptionTexts{{"-ts_type", "bdf"}, {"-ts_bdf_order", "4"}},
                                   OptionTexts{{"-ts_type", "beuler"}}})
    for (const int done : {1, 2, 6}) {
      const std::string file = "unit_history.h5";
      Kept run(texts);
      for (int k = 0; k < done; ++k) run.step(0.1);
      Facts facts;
      std::vector<NamedState> states;
      run.history.save(&facts, &states);
      states.push_back({"/state", run.state()});
      REQUIRE(write_checkpoint(run.model, file, facts, states) == 0);

      Kept next(texts);
      CheckpointFile saved;
      std::string missing;
      REQUIRE(saved.open(PETSC_COMM_WORLD, file) == 0);
      REQUIRE(saved.read(next.model, "/state", next.state()) == 0);
      REQUIRE(TSSetTime(next.ts, run.time()) == 0);
      REQUIRE(TSSetTimeStep(next.ts, 0.1) == 0);
      REQUIRE(TSSetStepNumber(next.ts, done) == 0);
      REQUIRE(next.history.restore(next.ts, next.model, saved, &missing) == 0);
      INFO(texts.at("-ts_type") << " after " << done << " steps");
      CHECK(missing.empty());
      CHECK_FALSE(next.history.replaying());
      CHECK(next.history.steps() == run.history.steps());
      CHECK(next.time() == run.time());
      CHECK(next.numbers() == run.numbers());
      for (int k = 0; k < 5; ++k) {
        run.step(0.1);
        next.step(0.1);
        const std::vector<double> a = run.numbers(), b = next.numbers();
        for (std::size_t c = 0; c < a.size(); ++c) CHECK(b[c] == Approx(a[c]).epsilon(1e-13));
      }
      MPI_Barrier(PETSC_COMM_WORLD);
      if (rank_of(PETSC_COMM_WORLD) == 0)
        for (const std::string& name : {file, previous_checkpoint(file)}) (void)unlink(name.c_str());
      MPI_Barrier(PETSC_COMM_WORLD);
    }
}
