// Laws of springs beyond Hooke's and the strain law: derivatives, energies, history, and the list they are in.
#include <cmath>
#include <set>

#include "lattice/lattice.hpp"
#include "laws_common.hpp"
#include "physics/pair/springs/mixed.hpp"

using namespace bs;
using namespace law_tests;

namespace {

/// A spring at some length, with what its law takes.
struct Sample {
  double k, L, l, p[SPRING_WIDTH], elapsed = 0;
};

/// Random ones; lengths from 0.3 to 3 rest lengths.
template <class Law>
Sample sample(Dice& dice) {
  Sample s{dice.between(1, 50), dice.between(0.3, 2), 0, {}};
  s.l = s.L * dice.between(0.3, 3);
  if (std::is_same_v<Law, PolynomialSpring>) {
    s.p[0] = dice.between(-2, 2) * s.k / s.L;
    s.p[1] = dice.between(-2, 2) * s.k / (s.L * s.L);
  }
  if (std::is_same_v<Law, PlasticSpring>) {
    s.p[PlasticSpring::Y] = s.k * s.L * dice.between(0.05, 1.5);
    s.p[PlasticSpring::H] = s.k * std::max(0.0, dice.between(-0.2, 2));
    s.p[PlasticSpring::E] = s.L * dice.between(-0.4, 0.8);
    s.p[PlasticSpring::PATH] = s.L * 0.9;
  }
  if (std::is_same_v<Law, MaxwellSpring>) {
    s.p[MaxwellSpring::TAU] = dice.between(0.1, 2);
    s.p[MaxwellSpring::X] = s.L * dice.between(-0.9, 2);
    s.elapsed = std::max(0.0, dice.between(-0.5, 2));
  }
  return s;
}

template <class Law, class F>
auto with(const Sample& s, F&& f) {
  return with_more<Law>(s.p, s.elapsed, std::forward<F>(f));
}

/// The potential in long double, each law's formula written anew.
long double potential(int law, const Sample& s, long double l) {
  const long double q = l - s.L, k = s.k;
  if (law == 0) return k * q * q / 2;
  if (law == 1) return k / s.L * q * q / 2;
  if (law == 2) return q > 0 ? k * q * q / 2 : 0;
  if (law == 5) return k * std::exp(-static_cast<long double>(s.elapsed) / s.p[0]) * (q - s.p[1]) * (q - s.p[1]) / 2;
  if (law == 3) return k * q * q / 2 + s.p[0] * q * q * q / 3 + s.p[1] * q * q * q * q / 4;
  // the least over e of what is stored and lost, by its three candidates: no flow, and flow to either side
  const long double Y = s.p[0], H = s.p[1], e0 = s.p[2];
  const auto of = [&](long double e) { return k * (q - e) * (q - e) / 2 + H * e * e / 2 + Y * std::abs(e - e0); };
  const long double up = std::max(e0, (k * q - Y) / (k + H)), down = std::min(e0, (k * q + Y) / (k + H));
  return std::min({of(e0), of(up), of(down)});
}

template <int d>
double length(const double* dx) {
  return std::sqrt(dot<d>(dx, dx));
}

/// Distance from the nearest kink of T(l); infinite where there is none.
double to_kink(int law, const Sample& s) {
  if (law == 2) return std::abs(s.l - s.L);
  if (law != 4) return INFINITY;
  const double middle = s.L + s.p[2] * (1 + s.p[1] / s.k), half = s.p[0] / s.k;
  return std::min(std::abs(s.l - middle - half), std::abs(s.l - middle + half));
}

struct Met {
  int soft = 0, slack = 0, taut = 0, yielding = 0, elastic = 0;
};

/// One state: T = de/dl, dT/dl, df/dx in d dimensions, the definite variant.
template <int d, class Law>
void check_state(int place, Sample s, Dice& dice, Met* met) {
  double dx[d];
  dice.direction<d>(s.l, dx);
  s.l = length<d>(dx);
  const double h = 1e-3 * s.L;
  if (to_kink(place, s) < 3 * h) return;
  double at = s.l;
  const double T = with<Law>(s, [&](auto... p) { return Law::tension(s.l, s.k, s.L, p...); });
  const double rate = with<Law>(s, [&](auto... p) { return Law::stiffness(s.l, s.k, s.L, p...); });
  require_close(&T, differences(&at, 1, 1, h, [&](double* e) { *e = static_cast<double>(potential(place, s, at)); }), 2e-9, s.k * s.L);
  require_close(&rate, differences(&at, 1, 1, h, [&](double* t) { *t = with<Law>(s, [&](auto... p) { return Law::tension(at, s.k, s.L, p...); }); }),
                1e-9, s.k);
  REQUIRE(with<Law>(s, [&](auto... p) { return Law::tension_over_length(s.l, s.k, s.L, p...); }) == Approx(T / s.l).epsilon(1e-14));
  double B[d * d] = {}, P[d * d] = {};
  with<Law>(s, [&](auto... p) { return spring_dfdx<d, Law>(dx, s.l, s.k, s.L, B, p...), 0; });
  with<Law>(s, [&](auto... p) { return spring_dfdx<d, Law, true>(dx, s.l, s.k, s.L, P, p...), 0; });
  const auto force = [&](double* f) { with<Law>(s, [&](auto... p) { return spring_force<d, Law>(dx, length<d>(dx), s.k, s.L, f, p...), 0; }); };
  require_close(B, differences(dx, d, d, h, force), 1e-8, s.k);
  for (int trial = 0; trial < 5; ++trial) {
    double z[d], sum = 0;
    dice.direction<d>(1, z);
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j) sum += z[i] * P[d * i + j] * z[j];
    REQUIRE(sum <= 1e-12 * (s.k + std::abs(rate)));
  }
  if (rate >= 0 && T >= 0)
    for (int i = 0; i < d * d; ++i) REQUIRE(P[i] == B[i]);
  met->soft += rate < 0;
  met->slack += rate == 0 && T == 0;
  met->taut += T > 0;
  if constexpr (std::is_same_v<Law, PlasticSpring>) (PlasticSpring::flow(s.l, s.k, s.L, s.p) != 0 ? met->yielding : met->elastic) += 1;
}

/// energy_beyond_slope for changes down to 1e-9 of the rest length, across kinks, too.
template <class Law>
void check_beyond(int place, const Sample& s, Dice& dice) {
  for (const double size : {2.0, 0.3, 1e-3, 1e-9}) {
    const double step = size * s.L * dice.between(-1, 1);
    if (s.l + step <= 0) continue;
    // the slope at l must be that of the same number l: from the formula, in long double
    const long double l = s.l, h = step;
    long double T = 0;
    const long double q = l - s.L;
    if (place == 0) T = s.k * q;
    if (place == 1) T = s.k / static_cast<long double>(s.L) * q;
    if (place == 2) T = q > 0 ? s.k * q : 0;
    if (place == 3) T = q * (s.k + q * (s.p[0] + q * static_cast<long double>(s.p[1])));
    if (place == 5) T = s.k * std::exp(-static_cast<long double>(s.elapsed) / s.p[0]) * (q - s.p[1]);
    if (place == 4) {
      const long double k = s.k, H = s.p[1], e0 = s.p[2], x = k * (q - e0) - H * e0, over = std::abs(x) - s.p[0];
      T = k * (q - e0 - (over > 0 ? std::copysign(over / (k + H), x) : 0));
    }
    const long double wanted = potential(place, s, l + h) - potential(place, s, l) - T * h;
    const double found = with<Law>(s, [&](auto... p) { return Law::energy_beyond_slope(s.l, step, s.k, s.L, p...); });
    // a kink's place is known to rounding of l; the difference of long doubles has errors of its own
    const double stiff = s.k * (1 + 3 * size) * 20, rounding = stiff * std::abs(step) * 4e-16 * 4 * s.L + 1e-18 * stiff * s.L * s.L;
    INFO("law " << place << ", step " << step << ", found " << found << ", wanted " << static_cast<double>(wanted));
    REQUIRE(std::abs(found - static_cast<double>(wanted)) <= 1e-12 * std::abs(static_cast<double>(wanted)) + rounding);
  }
}

/// What the tension changes by with each of the law's numbers, by differences, away from kinks of T.
template <class Law>
void check_numbers(int place, const Sample& s) {
  if (to_kink(place, s) < 1e-3 * s.L) return;
  const std::size_t count = 2 + Law::parameters.size();
  for (std::size_t of = 0; of < count; ++of) {
    double T[2];
    Sample moved = s;
    double& number = of == 0 ? moved.k : of == 1 ? moved.L : moved.p[of - 2];
    const double h = 1e-6 * std::max(std::abs(number), 0.01), was = number;
    for (const int side : {0, 1}) {
      number = was + (side == 0 ? h : -h);
      T[side] = with<Law>(moved, [&](auto... p) { return Law::tension(moved.l, moved.k, moved.L, p...); });
    }
    const double found = with<Law>(s, [&](auto... p) { return Law::tension_change(static_cast<int>(of), s.l, s.k, s.L, p...); });
    INFO("law " << place << ", number " << of << ": " << found << " for " << (T[0] - T[1]) / (2 * h));
    REQUIRE(std::abs(found - (T[0] - T[1]) / (2 * h)) <= 1e-7 * (std::abs(found) + std::abs(T[0]) / std::max(std::abs(was), 0.01) + 1e-2));
    REQUIRE(MixedSpring::tension_change(static_cast<int>(of), s.l, s.k, s.L, {place, s.p, s.elapsed}) == found);
  }
}

template <class Law>
Met check_law_of_springs(int place) {
  Dice dice(200 + static_cast<unsigned>(place));
  Met met;
  for (int n = 0; n < 300; ++n) {
    const Sample s = sample<Law>(dice);
    check_state<1, Law>(place, s, dice, &met);
    check_state<2, Law>(place, s, dice, &met);
    check_state<3, Law>(place, s, dice, &met);
    check_beyond<Law>(place, s, dice);
    check_numbers<Law>(place, s);
    const SpringRow row{place, s.p, s.elapsed};
    REQUIRE(MixedSpring::tension(s.l, s.k, s.L, row) == with<Law>(s, [&](auto... p) { return Law::tension(s.l, s.k, s.L, p...); }));
    REQUIRE(MixedSpring::stiffness(s.l, s.k, s.L, row) == with<Law>(s, [&](auto... p) { return Law::stiffness(s.l, s.k, s.L, p...); }));
    REQUIRE(MixedSpring::energy(s.l, s.k, s.L, row) == with<Law>(s, [&](auto... p) { return Law::energy(s.l, s.k, s.L, p...); }));
  }
  return met;
}

}  // namespace

TEST_CASE("every law of springs: tension, rates, tangent, energies and changes with its numbers at many states") {
  CHECK(check_law_of_springs<HookeSpring>(0).soft == 0);
  CHECK(check_law_of_springs<StrainSpring>(1).soft == 0);
  const Met cable = check_law_of_springs<TensionSpring>(2);
  CHECK((cable.slack > 100 && cable.taut > 100));
  CHECK(check_law_of_springs<PolynomialSpring>(3).soft > 100);
  const Met plastic = check_law_of_springs<PlasticSpring>(4);
  CHECK((plastic.yielding > 100 && plastic.elastic > 100));
  CHECK(check_law_of_springs<MaxwellSpring>(5).soft == 0);
}

TEST_CASE("the list of laws: names, what the program asks for by name, parameters") {
  std::set<std::string> names;
  for (const std::string& name : spring_law_names()) names.insert(name);
  CHECK(names.size() == std::tuple_size_v<SpringLaws>);
  CHECK(spring_law_names()[static_cast<std::size_t>(SpringLaw::hooke)] == "hooke");
  CHECK(spring_law_names()[static_cast<std::size_t>(SpringLaw::strain)] == "strain");
  CHECK(damper_law_names()[static_cast<std::size_t>(DampingLaw::axial)] == "axial");
  CHECK(damper_law_names()[static_cast<std::size_t>(DampingLaw::simple)] == "simple");
  for (const SpringLawInfo& law : spring_laws()) CHECK(law.width() <= SPRING_WIDTH);
  CHECK(spring_parameters().size() == 5);
  std::vector<std::string> histories;
  for (const SpringHistory& one : spring_histories()) histories.emplace_back(one.name);
  CHECK(histories == std::vector<std::string>{"plastic_stretch", "plastic_path", "viscous_stretch", "viscous_loss"});
}

TEST_CASE("plastic spring: cycles follow the closed form, work is stored or dissipated") {
  const double k = 10, L = 1, Y = 2, H = 2.5;
  double p[4] = {Y, H, 0, 0};
  // yields first at l - L = Y/k = 0.2; then T rises by kH/(k + H) = 2
  const auto T = [&](double stretch) { return PlasticSpring::tension(L + stretch, k, L, p); };
  CHECK(T(0.2) == Approx(2).epsilon(1e-14));
  CHECK(T(0.7) == Approx(2 + 2 * 0.5).epsilon(1e-14));
  PlasticSpring::commit(L + 0.7, k, L, p);
  CHECK(p[2] == Approx(0.4).epsilon(1e-14));  // q - T/k
  CHECK(T(0.7) == Approx(3).epsilon(1e-14));
  // back: elastic over 2 Y = 4 N, to T = -1 at 0.3 (Bauschinger), then by 2 again
  CHECK(T(0.3) == Approx(-1).epsilon(1e-13));
  CHECK(T(-0.7) == Approx(-1 - 2 * 1.0).epsilon(1e-14));
  CHECK(PlasticSpring::stiffness(L + 0.5, k, L, p) == k);
  CHECK(PlasticSpring::stiffness(L, k, L, p) == Approx(2).epsilon(1e-14));
  // a random walk: the work of all steps is what is stored and what is lost
  Dice dice(5);
  double l = L + 0.7, work = PlasticSpring::energy(l, k, L, p) + PlasticSpring::dissipated(k, p), lost = PlasticSpring::dissipated(k, p);
  CHECK(lost == Approx(Y * 0.4).epsilon(1e-14));
  for (int n = 0; n < 400; ++n) {
    const double step = dice.between(-0.6, 0.6);
    if (l + step < 0.1) continue;
    work += PlasticSpring::tension(l, k, L, p) * step + PlasticSpring::energy_beyond_slope(l, step, k, L, p);
    l += step;
    const double before = PlasticSpring::tension(l, k, L, p);
    PlasticSpring::commit(l, k, L, p);
    REQUIRE(PlasticSpring::tension(l, k, L, p) == Approx(before).epsilon(1e-12).margin(1e-13));
    REQUIRE(std::abs(before - H * p[2]) <= Y * (1 + 1e-13) + 1e-13);
    REQUIRE(PlasticSpring::dissipated(k, p) >= lost);
    lost = PlasticSpring::dissipated(k, p);
  }
  CHECK(PlasticSpring::energy(l, k, L, p) + lost == Approx(work).epsilon(1e-12));
  CHECK(lost > 20 * Y * 0.4);
}

TEST_CASE("maxwell spring: decay at constant length, books of a spring that is pulled") {
  const double k = 7, L = 1, tau = 0.3, e = 0.4;
  for (const double h : {0.001, 0.1, 0.3, 5.0}) {
    double p[3] = {tau, 0, 0}, t = 0;
    for (int n = 0; n < 50; ++n) {
      const double end = t + h, left = std::exp(-end / tau);
      REQUIRE(std::abs(MaxwellSpring::tension(L + e, k, L, p, h) - k * e * left) <= 1e-14 * k * e);
      MaxwellSpring::commit(L + e, k, L, p, h);
      t = end;
      REQUIRE(std::abs(MaxwellSpring::tension(L + e, k, L, p, 0) - k * e * left) <= 1e-14 * k * e);
      REQUIRE(MaxwellSpring::energy(L + e, k, L, p, 0) + MaxwellSpring::dissipated(k, p) == Approx(0.5 * k * e * e).epsilon(1e-13));
    }
  }
  // at the rate c of length the tension tends to k tau c, and the dashpot takes its power
  double p[3] = {tau, 0, 0}, lost = 0;
  const double c = 0.2, h = 1e-4;
  for (int n = 1; n <= 50000; ++n) {
    if (n == 40000) lost = MaxwellSpring::dissipated(k, p);
    MaxwellSpring::commit(L + n * h * c, k, L, p, h);
  }
  CHECK(MaxwellSpring::tension(L + 5 * c, k, L, p, 0) == Approx(k * tau * c).epsilon(h / tau));
  CHECK((MaxwellSpring::dissipated(k, p) - lost) / (10001 * h) == Approx(k * tau * c * c).epsilon(2 * h / tau));
  // statics: no time passes, the spring answers with k
  MaxwellSpring::commit(L + 9, k, L, p, 0);
  CHECK(MaxwellSpring::stiffness(L + 9, k, L, p, 0) == k);
}
