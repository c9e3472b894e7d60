// The first steps of bdf of order 3 to 6: extrapolated backward Euler.
#include "time/starter.hpp"
#include <cmath>
#include "options.hpp"
#include "small_model.hpp"
#include "time/ts_setup.hpp"

using namespace bs;

namespace {

/// y' = lambda y; z' = -z^2 + cos t
class Pair final : public SmallModel {
 public:
  Pair() : SmallModel({1, 0.5}) {}
  std::vector<double> rates(double t, const std::vector<double>& y) const override { return {LAMBDA * y[0], -y[1] * y[1] + std::cos(t)}; }
  std::vector<double> slopes(double, const std::vector<double>& y) const override { return {LAMBDA, 0, 0, -2 * y[1]}; }
  static constexpr double LAMBDA = -3;
};

/// One step of h from t = 0 by the starter of bdf of that order.
std::vector<double> start(PetscInt order, double h, PetscInt* newton = nullptr) {
  const Given given({{"-ts_type", "beuler"}, {"-snes_rtol", "1e-13"}, {"-ts_adapt_type", "none"}});
  Pair model;
  TSContext context;
  TSHandle ts;
  REQUIRE(create_ts(model, &context, &ts) == 0);
  REQUIRE(TSSetTimeStep(ts, h) == 0);
  REQUIRE(TSSetUp(ts) == 0);
  SNES own = nullptr, during = nullptr, afterwards = nullptr;
  REQUIRE(TSGetSNES(ts, &own) == 0);
  Starter starter;
  CHECK_FALSE(starter.active());
  REQUIRE(starter.begin(ts, order) == 0);
  CHECK(starter.active());
  REQUIRE(TSGetSNES(ts, &during) == 0);
  CHECK(during != own);
  starter.aim(h);
  REQUIRE(TSStep(ts) == 0);
  if (newton) REQUIRE(TSGetSNESIterations(ts, newton) == 0);
  REQUIRE(starter.end() == 0);
  REQUIRE(TSGetSNES(ts, &afterwards) == 0);
  CHECK(afterwards == own);
  CHECK_FALSE(starter.active());
  Vec y = nullptr;
  REQUIRE(TSGetSolution(ts, &y) == 0);
  return SmallModel::get(y);
}

}  // namespace

TEST_CASE("bdf starts from backward Euler's extrapolated values") {
  const double h = 0.2;
  for (PetscInt order = 3; order <= 6; ++order) {
    const int p = static_cast<int>(order) - 1;
    double expected = 0;
    for (int j = 1; j <= p; ++j) {
      double c = 1;
      for (int i = 1; i <= p; ++i)
        if (i != j) c *= double(j) / (j - i);
      expected += c * std::pow(1 - Pair::LAMBDA * h / j, -j);
    }
    PetscInt newton = 0;
    INFO("order " << order);
    CHECK(start(order, h, &newton)[0] == Approx(expected).epsilon(1e-11));
    CHECK(newton >= p * (p + 1) / 2);  // each of the 1 + 2 + ... + p parts is solved
  }
}

TEST_CASE("the first step of bdf of order k is accurate to order k - 1") {
  for (PetscInt order = 3; order <= 5; ++order) {
    double error[2];
    for (int k = 0; k < 2; ++k) {
      const double h = 0.02 / (1 << k);
      error[k] = std::abs(start(order, h)[0] - std::exp(Pair::LAMBDA * h));
    }
    INFO("order " << order);
    CHECK(std::log2(error[0] / error[1]) == Approx(double(order)).margin(0.2));
  }
}
