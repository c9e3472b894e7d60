// The periodic box in the course of time against F = I + G(t) written out, its rates against differences.
#include "systems/particles/constraints/cell.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include "held_network.hpp"

using namespace bs;

namespace {

OptionTexts periodic(const char* type, const char* size, const OptionTexts& more) {
  OptionTexts texts = {{"-bs_lattice_type", type}, {"-bs_lattice_size", size}, {"-bs_lattice_periodic", "xyz"}};
  if (std::string(type) == "square") texts["-bs_lattice_periodic"] = "xy";
  texts.insert(more.begin(), more.end());
  return texts;
}

void require_close(const double* found, const std::vector<double>& expected, double tolerance = 1e-13) {
  for (std::size_t k = 0; k < expected.size(); ++k) {
    INFO("entry " << k);
    REQUIRE(found[k] == Approx(expected[k]).epsilon(tolerance).margin(tolerance));
  }
}

std::string foreseen(const Cell& cell, double from, double to) {
  Error fault;
  cell.foresee(from, to, &fault);
  return fault ? fault.text : "";
}

}  // namespace

TEST_CASE("edges are F E: stretches and shears of a box in the plane", "[cell]") {
  const HeldNetwork at(periodic("square", "6,4", {{"-bs_box_strain", "xx=sinusoid:0.1,0.25,0.3,xy=velocity:0.2,yy=velocity:-0.05"}}));
  const Cell& cell = at.constraints.box();
  CHECK((cell.active() && cell.moving() && cell.triclinic()));
  const double pi = std::acos(-1.0);
  for (const double t : {0.0, 0.7, 2.3}) {
    const double w = 0.5 * pi, xx = 0.1 * std::sin(w * t + 0.3), xy = 0.2 * t, yy = -0.05 * t;
    const double dxx = 0.1 * w * std::cos(w * t + 0.3), dxy = 0.2, dyy = -0.05;
    double F[9], rate[9], e[9], de[9], L[9];
    cell.gradient(t, F, rate);
    require_close(F, {1 + xx, xy, 0, 1 + yy});
    require_close(rate, {dxx, dxy, 0, dyy});
    cell.edges(t, e, de);
    require_close(e, {6 * (1 + xx), 0, 4 * xy, 4 * (1 + yy)});
    require_close(de, {6 * dxx, 0, 4 * dxy, 4 * dyy});
    cell.edges(t, e, nullptr);
    require_close(e, {6 * (1 + xx), 0, 4 * xy, 4 * (1 + yy)});
    CHECK(cell.volume(t) == Approx(24 * (1 + xx) * (1 + yy)).epsilon(1e-14));
    // F'F^-1 of a triangular F
    cell.velocity_gradient(t, L);
    require_close(L, {dxx / (1 + xx), (dxy - dxx * xy / (1 + xx)) / (1 + yy), 0, dyy / (1 + yy)});
  }
}

TEST_CASE("a box in space: the rate of its volume is the trace of L, and A carries its edges along", "[cell]") {
  const HeldNetwork at(periodic("cubic", "4,3,5", {{"-bs_box_rate", "xx=0.03,yz=-0.02,zx=0.04"}, {"-bs_box_strain", "xy=sinusoid:0.2,0.1"}}));
  const double t = 1.3, h = 1e-5;
  double L[9], before[9], after[9], A[9];
  at.constraints.box().velocity_gradient(t, L);
  const double rate = (at.constraints.box().volume(t + h) - at.constraints.box().volume(t - h)) / (2 * h);
  CHECK(rate == Approx(at.constraints.box().volume(t) * (L[0] + L[4] + L[8])).epsilon(1e-8));
  // e_k' = L e_k
  at.constraints.box().edges(t - h, before, nullptr);
  at.constraints.box().edges(t + h, after, nullptr);
  double e[9];
  at.constraints.box().edges(t, e, nullptr);
  for (int k = 0; k < 3; ++k)
    for (int r = 0; r < 3; ++r) {
      double expected = 0;
      for (int c = 0; c < 3; ++c) expected += L[3 * r + c] * e[3 * k + c];
      CHECK((after[3 * k + r] - before[3 * k + r]) / (2 * h) == Approx(expected).margin(1e-8));
    }
  // e_k(t2) = A e_k(t1)
  at.constraints.box().edges(0.4, before, nullptr);
  at.constraints.box().edges(2.2, after, nullptr);
  at.constraints.box().carried(0.4, 2.2, A);
  for (int k = 0; k < 3; ++k) {
    std::vector<double> moved(3, 0.0);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) moved[static_cast<std::size_t>(r)] += A[3 * r + c] * before[3 * k + c];
    require_close(after + 3 * k, moved);
  }
  at.constraints.box().carried(0.4, 0.4, A);
  require_close(A, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 0);
}

TEST_CASE("images are shifted by their number of edges, and back in every bit of the shift", "[cell]") {
  const HeldNetwork at(periodic("square", "5,4", {{"-bs_box_strain", "xy=velocity:0.5"}}));
  const std::size_t local = static_cast<std::size_t>(at.net.n + at.net.ghosts);
  std::vector<double> states(4 * local, 1.0);
  at.constraints.box().shift_images(2, 1, true, states.data());
  for (std::size_t i = 0; i < local; ++i) {
    int s[2] = {0, 0};
    if (i >= static_cast<std::size_t>(at.net.n))
      for (std::size_t k = 0; k < 2; ++k) s[k] = at.net.image[2 * (i - static_cast<std::size_t>(at.net.n)) + k];
    require_close(states.data() + 4 * i, {1 + 5.0 * s[0] + 4.0 * s[1], 1 + 4.0 * s[1], 1 + 2.0 * s[1], 1});
  }
  at.constraints.box().shift_images(2, -1, false, states.data());
  for (std::size_t i = 0; i < local; ++i) require_close(states.data() + 4 * i, {1, 1});
  for (std::size_t i = 0; i < local; ++i)  // velocities stay
    if (i < static_cast<std::size_t>(at.net.n)) require_close(states.data() + 4 * i + 2, {1, 1});
}

TEST_CASE("a box at rest has no rates, one at full load is that of t = 1", "[cell]") {
  HeldNetwork at(periodic("square", "6,4", {{"-bs_box_strain", "yy=velocity:0.3"}}));
  double F[9], rate[9];
  at.constraints.box().set_static(true, false);
  at.constraints.box().gradient(0.5, F, rate);
  require_close(F, {1, 0, 0, 1.15});
  require_close(rate, {0, 0, 0, 0}, 0);
  at.constraints.box().set_static(true, true);
  at.constraints.box().gradient(0.5, F, rate);
  require_close(F, {1, 0, 0, 1.3});
}

TEST_CASE("a free strain bears its stress, is carried along from where it was kept, and is saved by name", "[cell]") {
  HeldNetwork at(periodic("square", "6,4", {{"-bs_box_stress", "xx=-20,yx=4"}, {"-bs_box_strain", "yy=velocity:0.5"}}));
  Cell& cell = at.constraints.box();
  CHECK(cell.moving());
  const auto at_half = cell.free_strains(0.5);
  REQUIRE(at_half.size() == 2);
  CHECK((at_half[0].row == 0 && at_half[0].column == 0 && at_half[0].strain == 0 && at_half[0].stress == -10));
  CHECK((at_half[1].row == 1 && at_half[1].column == 0 && at_half[1].stress == 2));
  double A[9], F[9], rate[9];
  cell.set_free_strains({0.1, 0.02});
  cell.gradient(1, F, rate);
  require_close(F, {1.1, 0, 0.02, 1.5});
  // nothing was kept at t = 0: F(0) was I
  cell.carried(0, 1, A);
  require_close(A, {1.1, 0, 0.02, 1.5});
  cell.keep_strains();
  cell.carried(1, 1, A);
  require_close(A, {1, 0, 0, 1});
  cell.set_free_strains({0.32, 0.02});
  cell.carried(1, 1, A);
  require_close(A, {1.2, 0, 0, 1});
  std::map<std::string, double> sums;
  cell.keep(Keeper(&sums));
  CHECK((sums.size() == 2 && sums.at("box_strain_xx") == 0.32 && sums.at("box_strain_yx") == 0.02));
  HeldNetwork other(periodic("square", "6,4", {{"-bs_box_stress", "xx=-20,yx=4"}}));
  other.constraints.box().keep(Keeper(sums));
  CHECK((other.constraints.box().free_strains(0)[0].strain == 0.32 && other.constraints.box().free_strains(0)[1].strain == 0.02));
  sums.clear();
  other.constraints.box().keep(Keeper(sums));
  CHECK(other.constraints.box().free_strains(0)[0].strain == 0);
}

TEST_CASE("a box without volume on its way is foreseen, one that turns or shears is not", "[cell]") {
  const HeldNetwork squeezed(periodic("square", "6,4", {{"-bs_box_strain", "xx=velocity:-1"}}));
  CHECK(foreseen(squeezed.constraints.box(), 0, 0.9).empty());
  CHECK(foreseen(squeezed.constraints.box(), 0.9, 1.1).find("no volume left on the way") != std::string::npos);
  CHECK(foreseen(squeezed.constraints.box(), 0, 2).find("no volume left") != std::string::npos);
  CHECK(foreseen(squeezed.constraints.box(), 1, 1).find("no volume at t = 1") != std::string::npos);
  // both edges turned round: the volume is the same again, but was 0 at t = 1
  const HeldNetwork turned(periodic("square", "6,4", {{"-bs_box_strain", "xx=velocity:-1,yy=velocity:-1"}}));
  CHECK(foreseen(turned.constraints.box(), 0, 2).find("no volume left on the way") != std::string::npos);
  const HeldNetwork sheared(periodic("square", "6,4", {{"-bs_box_strain", "xy=velocity:5"}}));
  CHECK(foreseen(sheared.constraints.box(), 0, 100).empty());
  // F = [1 a; -b 1] with a b > 0 never loses its volume 1 + a b; of a b < 0 it does at a b = -1
  const HeldNetwork rotating(periodic("square", "6,4", {{"-bs_box_strain", "xy=velocity:1,yx=velocity:-1"}}));
  CHECK(foreseen(rotating.constraints.box(), 0, 3).empty());
  const HeldNetwork flat(periodic("square", "6,4", {{"-bs_box_strain", "xy=velocity:1,yx=velocity:1"}}));
  CHECK(foreseen(flat.constraints.box(), 0, 0.9).empty());
  CHECK_FALSE(foreseen(flat.constraints.box(), 0, 1.2).empty());
}

TEST_CASE("a strain that jumps, or is not finite, is foreseen with its time", "[cell]") {
  const HeldNetwork jump(periodic("square", "6,4", {{"-bs_box_strain", "xx=expression:0.1*step(t-0.5)"}}));
  CHECK(foreseen(jump.constraints.box(), 0, 0.4).empty());
  const std::string text = foreseen(jump.constraints.box(), 0.4, 0.6);
  CHECK(text.find("xx jumps at t = 0.5") != std::string::npos);
  const HeldNetwork pole(periodic("square", "6,4", {{"-bs_box_strain", "xx=expression:0.01*t/(1-t)"}}));
  CHECK(foreseen(pole.constraints.box(), 0, 0.5).empty());
  CHECK(foreseen(pole.constraints.box(), 0.5, 1).find("not finite at t = 1") != std::string::npos);
}

TEST_CASE("a lattice without a periodic box has no cell", "[cell]") {
  const HeldNetwork at({{"-bs_lattice_type", "square"}, {"-bs_lattice_size", "6,4"}});
  CHECK_FALSE(at.constraints.box().active());
  CHECK_FALSE(at.constraints.box().moving());
  CHECK(at.constraints.box().describe().empty());
}
