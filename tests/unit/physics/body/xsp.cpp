// The laws of .xsp scenes: attraction to a centre, walls, pull of the centre of mass.
#include "laws_common.hpp"
#include "physics/body/registry.hpp"
#include "physics/whole/xsp_center_of_mass.hpp"

using namespace bs;
using namespace law_tests;

namespace {

/// Places x at a distance from C, inside or outside l = radius + 1 and clear of it.
template <int d>
void place(Dice& dice, const XspAttraction& law, bool inside, State<d>* s) {
  const double l = xsp_radius(s->m) + 1;
  double away[d];
  dice.direction<d>(inside ? dice.between(0.2, 0.95) * l : dice.between(1.05, 10) * l, away);
  for (int i = 0; i < d; ++i) s->x[i] = law.center[i] + away[i];
}

/// The acceleration by the rule "within l the vector to the centre is shortened by r/l and then taken as l long".
template <int d>
void shortened(double value, double p, double l, const double* x, const double* C, double* acceleration) {
  double r = 0, v[d];
  for (int i = 0; i < d; ++i) r += (C[i] - x[i]) * (C[i] - x[i]);
  r = std::sqrt(r);
  for (int i = 0; i < d; ++i) v[i] = (C[i] - x[i]) * (r < l ? r / l : 1);
  r = std::max(r, l);
  for (int i = 0; i < d; ++i) acceleration[i] = value / std::pow(r, p) / r * v[i];
}

template <int d>
void check_attraction(unsigned seed) {
  Dice dice(seed);
  const double exponents[] = {0, 1, 2, -1, 1.5, 3};
  for (int n = 0; n < 120; ++n) {
    XspAttraction law;
    law.value = dice.between(-20, 20);
    law.exponent = exponents[n % 6];
    for (double& c : law.center) c = dice.between(-2, 2);
    State<d> s(dice, 1);
    place(dice, law, n % 4 == 0, &s);
    check_law<d>(law, s, true, 2e-3);

    double f[d] = {}, wanted[d];
    law.force<d>(s.point(), f);
    shortened<d>(law.value, law.exponent, xsp_radius(s.m) + 1, s.x, law.center, wanted);
    for (double& c : wanted) c *= s.m;
    require_close(f, std::vector<double>(wanted, wanted + d), 1e-13);

    // by the centre's place: df/dC = -df/dx
    double K[d * d] = {};
    XspAttraction::attraction_dfdx<d>(s.m, law.value, law.exponent, s.x, law.center, K);
    for (double& k : K) k = -k;
    const auto force = [&](double* out) { XspAttraction::attraction_force<d>(s.m, law.value, law.exponent, s.x, law.center, out); };
    require_close(K, differences(law.center, d, d, 2e-3, force), 1e-9, largest(f, d));
  }
}

template <int d>
void check_walls(unsigned seed) {
  Dice dice(seed);
  const double exponents[] = {0, 1, 2, -1, 1.5};
  for (int n = 0; n < 100; ++n) {
    XspWalls law;
    law.value = dice.between(-50, 50);
    law.exponent = exponents[n % 5];
    const double box[4] = {-8, 9, -10, 7};
    std::copy(box, box + 4, law.box);
    for (int i = 0; i < 4; ++i) law.sides[i] = (n >> i) & 1;
    State<d> s(dice, 1);
    const double radius = xsp_radius(s.m);
    const auto clear = [&](double gap) { return std::abs(gap) > 0.02 && std::abs(gap - 1) > 0.02; };
    bool smooth = false;
    while (!smooth) {
      smooth = true;
      for (int i = 0; i < d; ++i) s.x[i] = dice.between(-11, 11);
      for (int i = 0; i < std::min(d, 2); ++i) smooth = smooth && clear(s.x[i] - box[2 * i] - radius) && clear(box[2 * i + 1] - radius - s.x[i]);
    }
    // behind a wall there is neither force nor change of energy, but the energy of the other walls goes on
    check_law<d>(law, s, true, 1e-3);
  }
}

}  // namespace

TEST_CASE("xsp: radius of a particle") {
  // 2 ln(4 m + 1): 3.2 at m = 1, 0.67 at 0.1, 39 at 1e8, 70.9 at 6e14
  REQUIRE(xsp_radius(1) == 3);
  REQUIRE(xsp_radius(0.1) == 1);
  REQUIRE(xsp_radius(1e8) == 39);
  REQUIRE(xsp_radius(6e14) == 64);
}

TEST_CASE("xsp attraction: force is -dE/dx and the rule's, derivatives agree with differences") {
  check_attraction<1>(41);
  check_attraction<2>(42);
  check_attraction<3>(43);
}

TEST_CASE("xsp attraction is continuous at l and nothing at the centre") {
  XspAttraction law;
  law.value = 7;
  law.exponent = 2;
  const double v[2] = {0, 0}, m = 1, l = xsp_radius(m) + 1;
  double before[2] = {0, 0}, after[2] = {0, 0}, f[2] = {0, 0}, K[4] = {0, 0, 0, 0};
  const double in[2] = {l * (1 - 1e-12), 0}, out[2] = {l * (1 + 1e-12), 0}, at[2] = {0, 0};
  REQUIRE(law.force<2>({0, m, {}, in, v}, before));
  REQUIRE(law.force<2>({0, m, {}, out, v}, after));
  REQUIRE(before[0] == Approx(after[0]).epsilon(1e-11));
  REQUIRE(before[0] == Approx(-7 / (l * l)).epsilon(1e-11));
  REQUIRE(law.energy<2>({0, m, {}, in, v}) == Approx(law.energy<2>({0, m, {}, out, v})).margin(1e-10));
  REQUIRE(law.force<2>({0, m, {}, at, v}, f));
  law.dfdx<2>({0, m, {}, at, v}, K);
  REQUIRE((f[0] == 0 && f[1] == 0 && largest(K, 4) == 0));
}

TEST_CASE("xsp walls: force is -dE/dx, derivatives agree with differences") {
  check_walls<1>(51);
  check_walls<2>(52);
  check_walls<3>(53);
}

TEST_CASE("xsp walls push away, each along its own axis, from gap 0 on") {
  const double v[2] = {0, 0}, m = 2, radius = xsp_radius(m);
  const struct {
    int side;
    double x, y, fx, fy;
  } cases[] = {{1, radius + 4, 300, 1, 0},
               {2, 642 - radius - 4, 300, -1, 0},
               {3, 300, radius + 4, 0, 1},
               {0, 300, 550 - radius - 4, 0, -1},
               {1, radius - 0.001, 300, 0, 0}};
  for (const auto& c : cases) {
    XspWalls law;
    law.value = 100;
    law.exponent = 1;
    law.sides[c.side] = true;
    const double x[2] = {c.x, c.y};
    double f[2] = {0, 0};
    REQUIRE(law.force<2>({0, m, {}, x, v}, f));
    REQUIRE(f[0] == Approx(c.fx * m * 100 / 4).margin(1e-12));
    REQUIRE(f[1] == Approx(c.fy * m * 100 / 4).margin(1e-12));
  }
  XspWalls law;  // within gap 1 the force is that of gap 1, on the wall itself too
  law.value = 100;
  law.exponent = 1;
  law.sides[1] = true;
  for (const double gap : {0.0, 0.5, 1.0}) {
    const double x[2] = {radius + gap, 0};
    double f[2] = {0, 0};
    REQUIRE(law.force<2>({0, m, {}, x, v}, f));
    REQUIRE(f[0] == Approx(m * 100));
  }
}

TEST_CASE("xsp pull of the centre of mass") {
  XspCenterOfMass law;
  REQUIRE_FALSE(law.active());
  law.value = 10;
  law.damping = 2;
  REQUIRE(law.active());
  const double X[2] = {4, -1}, V[2] = {0.5, 3}, C[2] = {1, 1};
  double a[2] = {100, 100};
  law.acceleration<2>(X, V, C, 5.0, a);
  REQUIRE(a[0] - 100 == Approx(-(10 * (4 - 1) + 2 * 0.5) / 5));
  REQUIRE(a[1] - 100 == Approx(-(10 * (-1 - 1) + 2 * 3.0) / 5));
}
