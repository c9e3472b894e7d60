// Hinges: derivatives by differences, energies in long double, closed forms of flat equilateral wings.
#include "physics/quadruple/hinge.hpp"
#include <algorithm>
#include "laws_common.hpp"

using namespace bs;
using law_tests::Dice;

namespace {

constexpr double PI = Hinge::PI;

/// Two wings of any shape at the angle theta, anywhere and turned anyhow.
struct Folded {
  double x[12], p[2];
  const double* at[4] = {x, x + 3, x + 6, x + 9};
  Folded(Dice& dice, double theta, double stiffness, double rest) : p{stiffness, rest} {
    double e[3], up[3], normal[3];
    dice.direction<3>(1, e);
    dice.direction<3>(1, up);
    const double along = dot<3>(e, up);
    for (int c = 0; c < 3; ++c) up[c] -= along * e[c];
    const double size = norm<3>(up);
    for (double& c : up) c /= size;
    for (int c = 0; c < 3; ++c) normal[c] = e[(c + 1) % 3] * up[(c + 2) % 3] - e[(c + 2) % 3] * up[(c + 1) % 3];
    const double l = dice.between(0.5, 2), height[2] = {dice.between(0.3, 2), dice.between(0.3, 2)};
    const double foot[2] = {dice.between(-0.5, 1.5) * l, dice.between(-0.5, 1.5) * l};
    for (int c = 0; c < 3; ++c) {
      x[c] = dice.between(-2, 2);
      x[3 + c] = x[c] + l * e[c];
      x[6 + c] = x[c] + foot[0] * e[c] + height[0] * up[c];
      x[9 + c] = x[c] + foot[1] * e[c] + height[1] * (-std::cos(theta) * up[c] + std::sin(theta) * normal[c]);
    }
  }
};

/// k/2 (theta - theta_0)^2 in long double, by the angle that the wings' heights over the edge enclose.
long double energy_of(const long double* x, const double* p) {
  long double e[3], u[2][3], l2 = 0, t[2] = {0, 0}, cosine = 0, sine = 0;
  for (int c = 0; c < 3; ++c) {
    e[c] = x[3 + c] - x[c];
    u[0][c] = x[6 + c] - x[c];
    u[1][c] = x[9 + c] - x[c];
    l2 += e[c] * e[c];
  }
  for (int w = 0; w < 2; ++w)
    for (int c = 0; c < 3; ++c) t[w] += u[w][c] * e[c] / l2;
  for (int w = 0; w < 2; ++w)
    for (int c = 0; c < 3; ++c) u[w][c] -= t[w] * e[c];
  for (int c = 0; c < 3; ++c) {
    cosine -= u[0][c] * u[1][c];
    sine += u[1][c] * (e[(c + 1) % 3] * u[0][(c + 2) % 3] - e[(c + 2) % 3] * u[0][(c + 1) % 3]) / std::sqrt(l2);
  }
  const long double off = std::atan2(sine, cosine) - static_cast<long double>(p[1]);
  return static_cast<long double>(p[0]) * off * off / 2;
}

void check_derivatives(double theta, double rest, unsigned seed) {
  Dice dice(seed);
  const Folded s(dice, theta, dice.between(0.5, 4), rest);
  Folded moved = s;
  INFO("theta = " << theta << ", rest " << rest);
  REQUIRE(Hinge::fault<3>(s.at, s.p) == nullptr);
  const double* at[4] = {moved.x, moved.x + 3, moved.x + 6, moved.x + 9};
  double f[12], K[144], D[144];
  Hinge::force<3>(at, s.p, f);
  Hinge::tangent<3, false>(at, s.p, K);
  Hinge::tangent<3, true>(at, s.p, D);
  REQUIRE(Hinge::energy<3>(at, s.p) == Approx(0.5 * s.p[0] * (theta - rest) * (theta - rest)).epsilon(1e-10).margin(1e-13));
  const auto energy = [&](double* e) { *e = -Hinge::energy<3>(at, s.p); };
  const auto force = [&](double* out) { Hinge::force<3>(at, s.p, out); };
  const double stiff = law_tests::largest(K, 144) + law_tests::largest(D, 144);
  law_tests::require_close(f, law_tests::differences(moved.x, 12, 1, 1e-3, energy), 1e-8, stiff + 1);
  law_tests::require_close(K, law_tests::differences(moved.x, 12, 12, 1e-3, force), 1e-7, stiff);
  Folded other = s;  // by the parameters, of which the force is linear
  for (int of = 0; of < 2; ++of) {
    double change[12];
    Hinge::force_change<3>(at, s.p, of, change);
    law_tests::require_close(change, law_tests::differences(&other.p[of], 1, 12, 1e-2, [&](double* out) { Hinge::force<3>(at, other.p, out); }),
                             1e-10, stiff + 1);
  }
  const double size = law_tests::largest(f, 12);
  for (int c = 0; c < 3; ++c) {  // forces and moments balance
    const int e = (c + 1) % 3;
    double sum = 0, moment = 0;
    for (int i = 0; i < 4; ++i) {
      sum += f[3 * i + c];
      moment += s.x[3 * i + c] * f[3 * i + e] - s.x[3 * i + e] * f[3 * i + c];
    }
    REQUIRE(std::abs(sum) <= 1e-15 * size);
    REQUIRE(std::abs(moment) <= 4e-14 * size);
  }
  for (int trial = 0; trial < 20; ++trial) {
    double z[12], product = 0;
    for (double& c : z) c = dice.normal();
    for (int r = 0; r < 12; ++r)
      for (int c = 0; c < 12; ++c) product -= z[r] * D[r * 12 + c] * z[c];
    REQUIRE(product >= -1e-12 * stiff);
  }
  for (int r = 0; r < 12; ++r)
    for (int c = 0; c < r; ++c) REQUIRE(K[r * 12 + c] == K[c * 12 + r]);
}

void check_change(double theta, double rest, double size, unsigned seed) {
  Dice dice(seed);
  const Folded s(dice, theta, 1.7, rest);
  double step[12], f[12], K[144];
  const double* dx[4] = {step, step + 3, step + 6, step + 9};
  for (double& c : step) c = size * dice.normal();
  Hinge::force<3>(s.at, s.p, f);
  Hinge::tangent<3, true>(s.at, s.p, K);
  const auto at = [&](long double part) {
    long double x[12];
    for (int k = 0; k < 12; ++k) x[k] = static_cast<long double>(s.x[k]) + part * static_cast<long double>(step[k]);
    return energy_of(x, s.p);
  };
  const long double h = std::min(1e-2L, 1e-5L / static_cast<long double>(size));
  const long double slope = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
  const double expected = static_cast<double>(at(1) - at(0) - slope), found = Hinge::energy_beyond_slope<3>(s.at, dx, s.p);
  INFO("theta " << theta << ", rest " << rest << ", step " << size << ": " << found << " for " << expected);
  REQUIRE(std::abs(found - expected) <= 1e-10 * law_tests::largest(K, 144) * size * size * 12 + 1e-17 / static_cast<double>(h));
}

}  // namespace

TEST_CASE("a hinge's force and tangent are the derivatives of its energy") {
  unsigned seed = 1;
  for (const double theta : {-3.0, -2.0, -PI / 2, -0.3, -1e-6, 0.0, 1e-9, 0.4, 1.5, 2.5, 3.1})
    for (const double rest : {0.0, 0.8, -1.3, PI}) check_derivatives(theta, rest, ++seed);
}

TEST_CASE("what a hinge's energy changes by beyond its slope keeps its digits") {
  unsigned seed = 100;
  for (const double theta : {-2.5, -0.4, 0.0, 1e-8, 0.7, 2.9})
    for (const double rest : {0.0, 0.9})
      for (const double size : {1e-9, 1e-6, 1e-3, 1e-2, 0.1}) check_change(theta, rest, size, ++seed);
}

TEST_CASE("flat equilateral wings of a hinge") {
  for (const double a : {1e-3, 1.0, 2.5}) {
    const double h = std::sqrt(0.75) * a, p[2] = {3, 0};
    const double x[12] = {0, 0, 0, a, 0, 0, a / 2, h, 0, a / 2, -h, 0}, p0[3] = {x[0], x[1], x[2]};
    const double* at[4] = {p0, x + 3, x + 6, x + 9};
    double rate[4], K[144], trace = 0;
    Hinge::rates<3>(at, p, rate);
    Hinge::tangent<3, false>(at, p, K);
    for (int k = 0; k < 12; ++k) trace -= K[13 * k];
    REQUIRE(rate[0] + rate[1] + rate[2] + rate[3] == Approx(16 * p[0] / (3 * a * a)).epsilon(1e-14));  // k sum |grad theta|^2
    REQUIRE(trace == Approx(16 * p[0] / (3 * a * a)).epsilon(1e-14));
  }
}

TEST_CASE("hinges without a direction say why") {
  const double p[2] = {1, 0}, zero[3] = {0, 0, 0}, one[3] = {1, 0, 0}, up[3] = {0, 1, 0}, down[3] = {0, -1, 0}, beyond[3] = {2, 1e-12, 0};
  const auto fault = [&](const double* a, const double* b, const double* c, const double* d) {
    const double* at[4] = {a, b, c, d};
    const char* why = Hinge::fault<3>(at, p);
    return std::string(why ? why : "");
  };
  CHECK(fault(zero, one, up, down).empty());
  CHECK(fault(zero, zero, up, down) == "an edge of zero length");
  CHECK(fault(zero, one, beyond, down) == "a first wing without area");
  CHECK(fault(zero, one, up, beyond) == "a second wing without area");
  const double fallen[3] = {std::nan(""), 0, 0};
  CHECK(!fault(zero, one, up, fallen).empty());
  const char* remedy = nullptr;
  const double good[2] = {0, PI}, negative[2] = {-1, 0}, low[2] = {1, -PI}, high[2] = {1, 4}, none[2] = {1, std::nan("")};
  CHECK(Hinge::bad_parameter(good, 3, &remedy) == -1);
  CHECK(Hinge::bad_parameter(negative, 3, &remedy) == 0);
  for (const double* bad : {low, high, none}) CHECK(Hinge::bad_parameter(bad, 3, &remedy) == 1);
}
