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
    uniform.fluid.buoyant = true;
    uniform.fluid.rho = dice.between(0.1, 3);
    uniform.fluid.radius = dice.between(0.2, 1);
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

TEST_CASE("a sphere in a fluid weighs what it displaces less") {
  UniformGravity law;
  law.g[1] = -10;
  law.fluid.rho = 3;
  law.fluid.radius = 0.5;
  const double x[2] = {1, 2}, v[2] = {0, 0}, own[1] = {0.2};
  ColumnPlaces places = no_columns;
  places[DisplacedFluid::column] = 0;
  const double sphere = 4.0 / 3.0 * 3.14159265358979323846;
  for (const bool buoyant : {false, true})
    for (const bool of_its_own : {false, true}) {
      law.fluid.buoyant = buoyant;
      const double a = of_its_own ? 0.2 : 0.5, left = 2.0 - (buoyant ? 3 * sphere * a * a * a : 0);
      const Point<2> p{0, 2.0, of_its_own ? ParticleNumbers{own, &places} : ParticleNumbers{}, x, v};
      double f[2] = {0, 0};
      REQUIRE(law.force<2>(p, f));
      REQUIRE((f[0] == 0 && f[1] == Approx(-10 * left).epsilon(1e-14)));
      REQUIRE(law.energy<2>(p) == Approx(20 * left).epsilon(1e-14));
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
