// The term dF/dt of Rosenbrock methods: exact where a source is smooth, harmless where it jumps.
#include <cmath>
#include <functional>
#include "options.hpp"
#include "small_model.hpp"
#include "time/implicit/predictor.hpp"
#include "time/ts_setup.hpp"

using namespace bs;

namespace {

/// y' = u(t) + lambda y
class Driven final : public SmallModel {
 public:
  Driven(std::function<double(double)> u, double start, double lambda = 0) : SmallModel({start}), u_(std::move(u)), lambda_(lambda) {}
  std::vector<double> rates(double t, const std::vector<double>& y) const override { return {u_(t) + lambda_ * y[0]}; }
  std::vector<double> slopes(double, const std::vector<double>&) const override { return {lambda_}; }
  bool time_dependent() const override { return true; }

 private:
  std::function<double(double)> u_;
  double lambda_;
};

struct Steps {
  TSContext context;
  TSHandle ts;
};

PetscErrorCode tell_stage(TS ts, PetscReal) {
  void* context = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &context));
  PetscCall(static_cast<Steps*>(context)->context.rosenbrock.before_stage(ts));
  PetscFunctionReturn(0);
}

/// y after `count` steps of h from time `start`.
double after(Driven& model, const std::string& subtype, double start, double h, int count) {
  const Given given({{"-ts_type", "rosw"},
                     {"-ts_rosw_type", subtype},
                     {"-ts_adapt_type", "none"},
                     {"-ksp_rtol", "1e-14"},
                     {"-pc_type", "lu"},
                     {"-ksp_type", "preonly"},
                     {"-mat_type", "aij"},
                     {"-pc_factor_mat_solver_type", "mumps"}});
  Steps run;
  REQUIRE(create_ts(model, &run.context, &run.ts) == 0);
  REQUIRE(TSSetApplicationContext(run.ts, &run) == 0);
  REQUIRE(TSSetPreStage(run.ts, tell_stage) == 0);
  REQUIRE(TSSetTime(run.ts, start) == 0);
  REQUIRE(TSSetTimeStep(run.ts, h) == 0);
  REQUIRE(TSSetUp(run.ts) == 0);
  for (int k = 0; k < count; ++k) REQUIRE(TSStep(run.ts) == 0);
  Vec y = nullptr;
  REQUIRE(TSGetSolution(run.ts, &y) == 0);
  return SmallModel::get(y)[0];
}

}  // namespace

TEST_CASE("a method of order 3 integrates a parabola exactly, also where its slope vanishes") {
  for (const double turn : {0.0, 0.1, 0.5, -2.0}) {
    Driven model([turn](double t) { return (t - turn) * (t - turn); }, 0);
    const auto integral = [turn](double t) { return std::pow(t - turn, 3) / 3; };
    INFO("slope 0 at t = " << turn);
    CHECK(after(model, "rodas3", 0, 0.5, 1) == Approx(integral(0.5) - integral(0)).epsilon(1e-9));
    Driven again([turn](double t) { return (t - turn) * (t - turn); }, 0);
    CHECK(after(again, "rodas3", 0, 0.5, 4) == Approx(integral(2) - integral(0)).epsilon(1e-9));
  }
}

TEST_CASE("the order of rosw holds for a source that begins with a slope of 0") {
  // y' = sin^2 t - y, y(0) = 0
  const auto exact = [](double t) { return 0.5 - (std::cos(2 * t) + 2 * std::sin(2 * t)) / 10 - 0.4 * std::exp(-t); };
  double error[2];
  for (int k = 0; k < 2; ++k) {
    Driven model([](double t) { return std::sin(t) * std::sin(t); }, 0, -1);
    const int count = 10 << k;
    error[k] = std::abs(after(model, "rodas3", 0, 1.0 / count, count) - exact(1));
  }
  INFO(error[0] << " " << error[1]);
  CHECK(std::log2(error[0] / error[1]) > 2.8);
}

TEST_CASE("a source that jumps or begins to rise just behind the start of a step has the slope from before") {
  for (const double at : {1e-9, 0.7e-3, 1.5e-3, 2.2e-3, 3.9e-3}) {  // of a step of 1, differences look as far as 4e-3
    INFO("t = " << at);
    Driven jump([at](double t) { return t < at ? 0 : 1.0; }, 0);
    CHECK(after(jump, "rodas3", 0, 1, 1) == Approx(1.0 / 3).epsilon(1e-9));
    Driven ramp([at](double t) { return std::max(0.0, t - at); }, 0);
    CHECK(after(ramp, "rodas3", 0, 1, 1) == Approx(0.5).margin(0.35));
  }
}
