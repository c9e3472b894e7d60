// The angle spring: derivatives by differences, known forces, energies in long double.
#include "physics/triple/angle_spring.hpp"
#include <algorithm>
#include "laws_common.hpp"

using namespace bs;
using law_tests::Dice;

namespace {

constexpr double PI = AngleSpring::PI;

/// Three ends with the angle theta at the middle one (two dimensions: counter-clockwise), anywhere and turned anyhow.
template <int d>
struct Bent {
  double x[3 * d], p[2];
  const double* at[3] = {x, x + d, x + 2 * d};
  Bent(Dice& dice, double theta, double stiffness, double rest) : p{stiffness, rest} {
    double a[d], b[d] = {}, across[d];
    dice.direction<d>(1, a);
    if constexpr (d == 2) {
      across[0] = -a[1];
      across[1] = a[0];
    } else {
      dice.direction<d>(1, across);
      const double along = dot<d>(a, across);
      for (int c = 0; c < d; ++c) across[c] -= along * a[c];
      const double size = norm<d>(across);
      for (double& c : across) c /= size;
    }
    const double la = dice.between(0.3, 2), lb = dice.between(0.3, 2);
    for (int c = 0; c < d; ++c) {
      b[c] = lb * (std::cos(theta) * a[c] + std::sin(theta) * across[c]);
      x[d + c] = dice.between(-2, 2);
      x[c] = x[d + c] + la * a[c];
      x[2 * d + c] = x[d + c] + b[c];
    }
  }
};

template <int d>
void check_derivatives(double theta, double rest, unsigned seed) {
  Dice dice(seed);
  Bent<d> s(dice, theta, dice.between(0.5, 4), rest);
  INFO("d = " << d << ", theta = " << theta << ", rest " << rest);
  REQUIRE(AngleSpring::fault<d>(s.at, s.p) == nullptr);
  // near a singular angle the scale on which the force changes is the distance from it
  const double distance = d == 3 && rest != PI ? std::min(theta, PI - theta) : 1.0, h = 1e-3 * std::min(1.0, distance);
  double f[3 * d], K[9 * d * d], D[9 * d * d];
  AngleSpring::force<d>(s.at, s.p, f);
  const double E = AngleSpring::energy<d>(s.at, s.p), stiff = s.p[0] / 0.09;
  const auto energy = [&](double* e) { *e = -AngleSpring::energy<d>(s.at, s.p); };
  const auto force = [&](double* out) { AngleSpring::force<d>(s.at, s.p, out); };
  law_tests::require_close(f, law_tests::differences(s.x, 3 * d, 1, h, energy), 1e-8, stiff + E);
  AngleSpring::tangent<d, false>(s.at, s.p, K);
  law_tests::require_close(K, law_tests::differences(s.x, 3 * d, 3 * d, h, force), 1e-8, stiff);
  // by the parameters, of which the force is linear
  for (int of = 0; of < 2; ++of) {
    double change[3 * d];
    AngleSpring::force_change<d>(s.at, s.p, of, change);
    law_tests::require_close(change, law_tests::differences(&s.p[of], 1, 3 * d, 1e-2, force), 1e-10, stiff + E);
  }
  // forces and moments balance
  const double size = law_tests::largest(f, 3 * d);
  for (int c = 0; c < d; ++c) {
    const int e = (c + 1) % d;
    double moment = 0;
    for (int i = 0; i < 3; ++i) moment += s.x[i * d + c] * f[i * d + e] - s.x[i * d + e] * f[i * d + c];
    REQUIRE(std::abs(f[c] + f[d + c] + f[2 * d + c]) <= 4e-16 * size);
    REQUIRE(std::abs(moment) <= 2e-14 * size);
  }
  // the positive variant: -z.D z >= 0, symmetric, and never above what is left out
  AngleSpring::tangent<d, true>(s.at, s.p, D);
  for (int trial = 0; trial < 20; ++trial) {
    double z[3 * d], product = 0;
    for (double& c : z) c = dice.normal();
    for (int r = 0; r < 3 * d; ++r)
      for (int c = 0; c < 3 * d; ++c) product -= z[r] * D[r * 3 * d + c] * z[c];
    REQUIRE(product >= -1e-12 * law_tests::largest(D, 9 * d * d));
  }
  for (int r = 0; r < 3 * d; ++r)
    for (int c = 0; c < r; ++c) {
      REQUIRE(std::abs(K[r * 3 * d + c] - K[c * 3 * d + r]) <= 1e-14 * law_tests::largest(K, 9 * d * d));
      REQUIRE(std::abs(D[r * 3 * d + c] - D[c * 3 * d + r]) <= 1e-14 * law_tests::largest(D, 9 * d * d));
    }
}

/// kappa/2 (phi - phi_0)^2 in long double, by the formula of the header.
template <int d>
long double energy_of(const long double* x, const double* p) {
  long double a[3] = {0, 0, 0}, b[3] = {0, 0, 0};
  for (int c = 0; c < d; ++c) {
    a[c] = x[c] - x[d + c];
    b[c] = x[2 * d + c] - x[d + c];
  }
  const long double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  const long double S = d == 2 ? n[2] : std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  const long double phi = std::atan2(S, -(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]));
  const long double e = phi - static_cast<long double>(PI - p[1]);
  return static_cast<long double>(p[0]) * e * e / 2;
}

template <int d>
void check_change(double theta, double rest, double size, unsigned seed) {
  Dice dice(seed);
  Bent<d> s(dice, theta, 1.7, rest);
  double step[3 * d], f[3 * d];
  const double* dx[3] = {step, step + d, step + 2 * d};
  for (double& c : step) c = size * dice.normal();
  AngleSpring::force<d>(s.at, s.p, f);
  long double before[3 * d], after[3 * d];
  for (int k = 0; k < 3 * d; ++k) {
    before[k] = s.x[k];
    after[k] = before[k] + static_cast<long double>(step[k]);
  }
  // the slope in long double: a Richardson difference of the energy along the step
  const auto along = [&](long double part) {
    long double x[3 * d];
    for (int k = 0; k < 3 * d; ++k) x[k] = before[k] + part * static_cast<long double>(step[k]);
    return energy_of<d>(x, s.p);
  };
  const long double h = std::min(1.0L, 1e-5L / static_cast<long double>(size));
  const long double slope = (8 * (along(h) - along(-h)) - (along(2 * h) - along(-2 * h))) / (12 * h);
  const long double expected = energy_of<d>(after, s.p) - energy_of<d>(before, s.p) - slope;
  const double found = AngleSpring::energy_beyond_slope<d>(s.at, dx, s.p);
  INFO("d = " << d << ", theta " << theta << ", rest " << rest << ", step " << size);
  // long double leaves 1e-19 E/h in the slope, beside terms of size kappa (step/arm)^2
  const double terms = 1.7 * size * size / 0.09;
  REQUIRE(std::abs(found - static_cast<double>(expected)) <= 1e-11 * terms + 1e-17 / static_cast<double>(h));
}

}  // namespace

TEST_CASE("an angle spring's force and tangent are the derivatives of its energy") {
  unsigned seed = 1;
  for (const double theta : {0.3, 1.0, PI / 2, 2.2, 3.0, PI - 1e-2})
    for (const double rest : {PI, 0.7, 1.9, 2.8}) {
      check_derivatives<2>(theta, rest, ++seed);
      check_derivatives<2>(2 * PI - theta, rest, ++seed);
      check_derivatives<3>(theta, rest, ++seed);
    }
  for (const double off : {1e-3, 1e-5, 1e-7, 1e-9, 1e-12, 1e-15, 0.0}) {
    check_derivatives<2>(PI - off, PI, ++seed);
    check_derivatives<2>(PI + off, 2.0, ++seed);
    check_derivatives<2>(PI - off, 5.0, ++seed);
    check_derivatives<3>(PI - off, PI, ++seed);
  }
}

TEST_CASE("an angle spring has a known force at known places") {
  // arms of 2 and 0.5 m at a right angle, at rest at 60 degrees: a moment of kappa pi/6 pulls them together
  const double x[3][3] = {{2, 0, 0}, {0, 0, 0}, {0, 0.5, 0}}, p[2] = {3, PI / 3};
  const double* at[3] = {x[0], x[1], x[2]};
  double f[9];
  AngleSpring::force<3>(at, p, f);
  const double moment = 3 * PI / 6;
  CHECK(f[1] == Approx(moment / 2).epsilon(1e-14));
  CHECK(f[6] == Approx(moment / 0.5).epsilon(1e-14));
  CHECK(AngleSpring::energy<3>(at, p) == Approx(1.5 * PI * PI / 36).epsilon(1e-14));
  // in two dimensions the other side is 270 degrees
  const double* swapped[3] = {x[2], x[1], x[0]};
  CHECK(AngleSpring::energy<2>(swapped, p) == Approx(1.5 * std::pow(1.5 * PI - PI / 3, 2)).epsilon(1e-14));
}

TEST_CASE("an angle spring says where it has no force") {
  const double x[4][3] = {{1, 0, 0}, {0, 0, 0}, {-1, 0, 0}, {2, 0, 0}}, straight[2] = {1, PI}, bent[2] = {1, 2};
  const double *open[3] = {x[0], x[1], x[2]}, *folded[3] = {x[0], x[1], x[3]}, *short_arm[3] = {x[0], x[1], x[1]};
  CHECK(AngleSpring::fault<3>(open, straight) == nullptr);
  CHECK(AngleSpring::fault<2>(open, bent) == nullptr);
  CHECK(std::string(AngleSpring::fault<3>(open, bent)).find("straight angle") != std::string::npos);
  CHECK(std::string(AngleSpring::fault<2>(folded, straight)).find("angle of 0") != std::string::npos);
  CHECK(std::string(AngleSpring::fault<3>(folded, straight)).find("angle of 0") != std::string::npos);
  CHECK(std::string(AngleSpring::fault<3>(short_arm, straight)).find("zero length") != std::string::npos);
}

TEST_CASE("an angle spring's energy changes beyond its slope as in long double") {
  unsigned seed = 100;
  for (const double size : {1e-9, 1e-7, 1e-5, 1e-3, 0.1}) {
    for (const double theta : {0.8, 1.9, 3.0})
      for (const double rest : {PI, 1.2}) {
        check_change<2>(theta, rest, size, ++seed);
        check_change<3>(theta, rest, size, ++seed);
      }
    check_change<2>(PI, PI, size, ++seed);
    check_change<2>(PI, 2.5, size, ++seed);
    check_change<3>(PI - 0.02, PI, size, ++seed);
  }
}

TEST_CASE("a straight angle spring bends alike in every direction, and keeps its digits") {
  const double x[3][3] = {{1, 0, 0}, {0, 0, 0}, {-1, 0, 0}}, p[2] = {2, PI};
  const double* at[3] = {x[0], x[1], x[2]};
  for (const double size : {1e-12, 1e-8, 1e-4})
    for (int k = 0; k < 8; ++k) {
      const double step[9] = {0, 0, 0, 0, size * std::cos(k), size * std::sin(k), 0, 0, 0}, *dx[3] = {step, step + 3, step + 6};
      const double phi = 2 * std::atan(size);
      CHECK(AngleSpring::energy_beyond_slope<3>(at, dx, p) == Approx(phi * phi).epsilon(1e-12));
      double K[81], product = 0;
      AngleSpring::tangent<3, true>(at, p, K);
      for (int r = 0; r < 9; ++r)
        for (int c = 0; c < 9; ++c) product -= step[r] * K[r * 9 + c] * step[c];
      CHECK(product == Approx(2 * 4 * size * size).epsilon(1e-12));
    }
}
