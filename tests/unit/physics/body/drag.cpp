// Stokes drag, viscosity, sphere drag, shape drag.
#include "laws_common.hpp"
#include "physics/body/registry.hpp"

using namespace bs;
using namespace law_tests;

namespace {

constexpr double pi = 3.14159265358979323846;

/// The classic case: a ball of ice in air.
SphereDrag classic_air() {
  SphereDrag law;
  law.on = true;
  law.rho = 0.9;
  law.mu = 1.693e-5;
  return law;
}

double ball_mass(double a, double density) { return 4.0 / 3.0 * pi * a * a * a * density; }

/// 1/2 rho pi a^2 C_D |u| u as textbooks write it, infinite C_D at u = 0 included.
double textbook_drag(const SphereDrag& law, double a, double u) {
  const double Re = 2 * a * law.rho * std::abs(u) / law.mu;
  const double C_D = 24 / Re + 6 / (1 + std::sqrt(Re)) + 0.4;
  return 0.5 * law.rho * pi * a * a * C_D * std::abs(u) * u;
}

/// A fluid in which Re runs from 0.5 to 5e4 over the states.
template <int d>
SphereDrag random_fluid(Dice& dice) {
  SphereDrag law;
  law.on = true;
  law.rho = dice.between(0.5, 5);
  law.mu = std::pow(10.0, dice.between(-4, -1));
  for (double& c : law.fluid) c = dice.between(-2, 2);
  return law;
}

template <int d>
void check_drag(unsigned seed) {
  Dice dice(seed);
  for (int n = 0; n < 60; ++n) {
    StokesDrag stokes;
    stokes.D = dice.between(0.1, 4);
    check_law<d>(stokes, State<d>(dice, 1), false);
    MassDrag viscous;
    viscous.c = dice.between(0.1, 4);
    check_law<d>(viscous, State<d>(dice, 1), false);

    State<d> dragged(dice, 1);
    ParticleDrag of_each;
    of_each.given = true;
    dragged.own[ParticleDrag::column] = dice.between(0.1, 4);
    check_law<d>(of_each, dragged, false);

    const SphereDrag sphere = random_fluid<d>(dice);
    State<d> s(dice, 1);  // its v is taken relative to the fluid, 0.2 at least: differences stay clear of the root at 0
    for (int i = 0; i < d; ++i) s.v[i] += sphere.fluid[i];
    check_law<d>(sphere, s, false, 5e-4);

    ShapeDrag shape;
    shape.rho = dice.between(0.5, 5);
    shape.area = dice.between(0.1, 2);
    shape.drag_coefficient = dice.between(0.04, 1.2);
    std::copy(sphere.fluid, sphere.fluid + 3, shape.fluid);
    check_law<d>(shape, s, false, 5e-4);
  }
}

template <int d>
void check_stokes_limit(unsigned seed) {
  Dice dice(seed);
  for (int n = 0; n < 60; ++n) {
    SphereDrag law = random_fluid<d>(dice);
    law.mu = dice.between(0.1, 1);
    State<d> s(dice, 1);
    double D[d * d] = {}, f[d] = {}, u[d];
    const double stokes = 6 * pi * law.mu * s.a;
    for (int i = 0; i < d; ++i) s.v[i] = law.fluid[i];
    REQUIRE(law.force<d>(s.point(), f));
    law.dfdv<d>(s.point(), D);
    for (int i = 0; i < d; ++i) REQUIRE(f[i] == 0);
    for (int i = 0; i < d * d; ++i) REQUIRE(D[i] == Approx(i % (d + 1) != 0 ? 0 : -stokes).epsilon(1e-15));
    // beside it: v is the small velocity itself, the fluid at rest, so that nothing is lost in their difference
    for (double& c : law.fluid) c = 0;
    for (const double speed : {1e-16, 1e-100, 1e-170}) {
      dice.direction<d>(speed, u);
      std::copy(u, u + d, s.v);
      for (int i = 0; i < d; ++i) f[i] = 0;
      for (double& k : D) k = 0;
      REQUIRE(law.force<d>(s.point(), f));
      law.dfdv<d>(s.point(), D);
      for (int i = 0; i < d; ++i) REQUIRE(std::abs(f[i] + stokes * u[i]) <= 1e-12 * stokes * speed);
      for (int i = 0; i < d * d; ++i) REQUIRE(std::abs(D[i] + (i % (d + 1) != 0 ? 0 : stokes)) <= 1e-12 * stokes);
    }
  }
}

/// acc(u) and d acc/du of a ball that falls along +x, against rows of u, Re, acc, dacc/du.
void check_falling(const char* file, const SphereDrag& law, double a, double density, double g) {
  const auto rows = oracle(file);
  if (rows.empty()) {
    WARN("../shared/oracles/" << file << " is absent: not compared");
    return;
  }
  const double m = ball_mass(a, density);
  for (const auto& row : rows) {
    const double u = row[0], x = 0;
    double f = m * g, D = 0;
    REQUIRE(law.force<1>({0, m, {&a, &radius_alone()}, &x, &u}, &f));
    law.dfdv<1>({0, m, {&a, &radius_alone()}, &x, &u}, &D);
    INFO("u = " << u);
    REQUIRE(2 * a * law.rho * u / law.mu == Approx(row[1]).epsilon(1e-14));
    REQUIRE(f / m == Approx(row[2]).epsilon(1e-13).margin(1e-13 * g));
    REQUIRE(D / m == Approx(row[3]).epsilon(1e-13));
  }
}

}  // namespace

TEST_CASE("drag: derivatives agree with differences") {
  check_drag<1>(21);
  check_drag<2>(22);
  check_drag<3>(23);
}

TEST_CASE("sphere drag is Stokes drag at and near rest") {
  check_stokes_limit<1>(31);
  check_stokes_limit<2>(32);
  check_stokes_limit<3>(33);
}

TEST_CASE("sphere drag is the textbook's away from rest, whichever way the ball moves") {
  const SphereDrag law = classic_air();
  for (const double speed : {1e-6, 5e-4, 0.01, 1.0, 24.0, 60.0})
    for (const double u : {speed, -speed}) {
      const double x = 0, a = 0.01;
      double f = 0;
      REQUIRE(law.force<1>({0, 1, {&a, &radius_alone()}, &x, &u}, &f));
      REQUIRE(f == Approx(-textbook_drag(law, a, u)).epsilon(1e-14));
    }
}

TEST_CASE("sphere drag balances weight at the terminal velocity of the classic case") {
  const double a = 0.01, m = ball_mass(a, 917), g = 9.8, x = 0, u = 24.66337697900565;
  double f = m * g, D = 0;
  REQUIRE(classic_air().force<1>({0, m, {&a, &radius_alone()}, &x, &u}, &f));
  classic_air().dfdv<1>({0, m, {&a, &radius_alone()}, &x, &u}, &D);
  REQUIRE(std::abs(f) <= 1e-14 * m * g);
  REQUIRE(D / m == Approx(-0.777259).epsilon(1e-6));  // rate at which it is approached
}

TEST_CASE("sphere drag takes the particle's own radius first") {
  SphereDrag law = classic_air();
  law.radius = 0.02;
  const double x = 0, u = 1.5, a = 0.01, none = 0;
  double own = 0, given = 0, without = 0;
  law.force<1>({0, 1, {&a, &radius_alone()}, &x, &u}, &own);
  law.force<1>({0, 1, {&none, &radius_alone()}, &x, &u}, &without);
  REQUIRE(without == Approx(-textbook_drag(law, 0.02, u)).epsilon(1e-14));
  law.force<1>({0, 1, {}, &x, &u}, &given);
  REQUIRE(own == Approx(-textbook_drag(law, 0.01, u)).epsilon(1e-14));
  REQUIRE(given == Approx(-textbook_drag(law, 0.02, u)).epsilon(1e-14));
}

TEST_CASE("sphere drag agrees with the oracles of free fall") {
  check_falling("A_freefall/seed/jacobian.csv", classic_air(), 0.01, 917, 9.8);
  SphereDrag mist;
  mist.on = true;
  mist.rho = 1.2;
  mist.mu = 1.8e-5;
  check_falling("A_freefall/droplet/jacobian.csv", mist, 1e-4, 1000, 9.8);
}

TEST_CASE("drag of each particle is its own coefficient's, and 0 without one") {
  const ParticleDrag law;
  const double x[2] = {0, 0}, v[2] = {3, -4}, dv[2] = {0.5, 2}, c[2] = {0.01, 0.7};
  REQUIRE_FALSE(law.active());
  double f[2] = {0, 0}, A[4] = {0, 0, 0, 0};
  const Point<2> p{0, 1, {c, &all_columns()}, x, v};
  REQUIRE((ParticleDrag::column == 1 && p.column(0) == 0.01 && p.column(1) == 0.7));
  REQUIRE(law.force<2>(p, f));
  law.dfdv<2>(p, A);
  REQUIRE((f[0] == Approx(-2.1).epsilon(1e-15) && f[1] == Approx(2.8).epsilon(1e-15)));
  REQUIRE((A[0] == -0.7 && A[1] == 0 && A[2] == 0 && A[3] == -0.7));
  const auto R = [&](double s) { return 0.5 * c[1] * (std::pow(v[0] + s * dv[0], 2) + std::pow(v[1] + s * dv[1], 2)); };
  REQUIRE(law.dissipation_beyond_slope<2>(p, dv) == Approx(R(1) - R(0) + f[0] * dv[0] + f[1] * dv[1]).epsilon(1e-13));
  f[0] = f[1] = 0;
  REQUIRE(law.force<2>({0, 1, {c, &radius_alone()}, x, v}, f));  // a lattice without the column
  REQUIRE((f[0] == 0 && f[1] == 0));
}

TEST_CASE("shape drag at rest is nothing, and half the density times C_D A at 1 m/s") {
  ShapeDrag law;
  law.rho = 1.2;
  law.area = 0.3;
  law.drag_coefficient = 1.05;
  const double x[2] = {0, 0}, still[2] = {0, 0}, slow[2] = {0.6, -0.8};
  double f[2] = {0, 0}, D[4] = {0, 0, 0, 0};
  REQUIRE(law.force<2>({0, 1, {}, x, still}, f));
  law.dfdv<2>({0, 1, {}, x, still}, D);
  REQUIRE((f[0] == 0 && f[1] == 0 && largest(D, 4) == 0));
  REQUIRE(law.force<2>({0, 1, {}, x, slow}, f));
  REQUIRE(f[0] == Approx(-0.5 * 1.2 * 0.3 * 1.05 * 0.6).epsilon(1e-14));
  REQUIRE(f[1] == Approx(0.5 * 1.2 * 0.3 * 1.05 * 0.8).epsilon(1e-14));
}
