// Uniform and central gravity, and what holds for every particle law.
#include "laws_common.hpp"
#include "physics/body/registry.hpp"

using namespace bs;
using namespace law_tests;

namespace {

template <int d>
void check_gravity(unsigned seed) {
  Dice dice(seed);
  for (int n = 0; n < 60; ++n) {
    UniformGravity uniform;
    for (double& g : uniform.g) g = dice.between(-10, 10);
    check_law<d>(uniform, State<d>(dice, 2), true);

    CentralGravity central;
    central.G = dice.between(0.5, 2);
    central.M0 = dice.between(0.5, 3);
    for (double& c : central.x0) c = dice.between(-1, 1);
    State<d> s(dice, 1);
    double away[d];
    dice.direction<d>(dice.between(0.7, 4), away);
    for (int i = 0; i < d; ++i) s.x[i] = central.x0[i] + away[i];
    check_law<d>(central, s, true, 5e-4);
  }
}

}  // namespace

TEST_CASE("gravity: force is -dE/dx, derivatives agree with differences") {
  check_gravity<1>(11);
  check_gravity<2>(12);
  check_gravity<3>(13);
}

TEST_CASE("central gravity has the weight of the Earth's surface and no value at the centre") {
  CentralGravity law;
  REQUIRE_FALSE(law.active());
  law.M0 = 5.9722e24;
  REQUIRE(law.active());
  const double x[3] = {0, 0, 6.371e6}, v[3] = {0, 0, 0};
  double f[3] = {0, 0, 0};
  REQUIRE(law.force<3>({0, 2.0, {}, x, v}, f));
  REQUIRE(f[2] == Approx(-2.0 * 6.6743e-11 * 5.9722e24 / (6.371e6 * 6.371e6)).epsilon(1e-14));
  REQUIRE(f[2] == Approx(-2.0 * 9.82).epsilon(1e-3));
  for (const double tiny : {0.0, 1e-200}) {
    const double at[3] = {tiny, 0, 0};
    double g[3] = {1, 2, 3}, K[9] = {4};
    REQUIRE_FALSE(law.force<3>({0, 2.0, {}, at, v}, g));
    law.dfdx<3>({0, 2.0, {}, at, v}, K);
    REQUIRE((g[0] == 1 && g[1] == 2 && g[2] == 3 && K[0] == 4 && K[4] == 0));
  }
}

TEST_CASE("every particle law is off until asked for") {
  ParticleLaws laws;
  int count = 0;
  for_each_law(laws, [&](const auto& law) {
    ++count;
    INFO(law.title);
    REQUIRE_FALSE(law.active());
    REQUIRE_FALSE(law.describe().empty());
  });
  REQUIRE(count == static_cast<int>(std::tuple_size<ParticleLaws>::value));
}
