// What is held, where it is and what becomes of its rows, against a list written out by hand of a lattice with every kind of constraint.
#include "systems/particles/constraints/constraints.hpp"
#include <algorithm>
#include <catch2/catch.hpp>
#include "held_network.hpp"
#include "systems/particles/constraints/free_bodies.hpp"
#include "systems/particles/row_pattern.hpp"

using namespace bs;

namespace {

/// A net of 7 x 5 at unit spacing: the column x = 0 is fixed, x = 6 is driven, y = 0 rolls along x between them.
const OptionTexts NET = {{"-bs_lattice_type", "square"},
                         {"-bs_lattice_size", "7,5"},
                         {"-bs_lattice_fixed", "xmin"},
                         {"-bs_group_right", "xmax"},
                         {"-bs_motion_right", "velocity:0.3,-0.2"},
                         {"-bs_group_floor", "ids:1-5"},
                         {"-bs_motion_floor", "y=fixed"}};

std::uint8_t expected_mask(const double* x0) { return x0[0] < 0.5 || x0[0] > 5.5 ? 3 : x0[1] < 0.5 ? 2 : 0; }

}  // namespace

TEST_CASE("what is held is known component by component, of ghosts too, and is 0 in directions and forces", "[constraints]") {
  const HeldNetwork at(NET);
  const Constraints& c = at.constraints;
  CHECK((c.rolls() && c.drives() && c.holds_groups() && c.time_dependent()));
  const PetscInt count = at.net.n + at.net.ghosts;
  std::vector<double> force(static_cast<std::size_t>(2 * count), 7), pair(static_cast<std::size_t>(4 * count), 7);
  c.clear(0, count, 1, force.data());
  c.clear(0, at.net.n, 2, pair.data());
  for (PetscInt i = 0; i < count; ++i) {
    const std::uint8_t mask = expected_mask(at.net.held.data() + 2 * i);
    REQUIRE(c.held(i) == mask);
    for (int k = 0; k < 2; ++k) REQUIRE(force[static_cast<std::size_t>(2 * i + k)] == (mask >> k & 1 ? 0 : 7));
    for (int k = 0; k < 4; ++k) REQUIRE(pair[static_cast<std::size_t>(4 * i + k)] == (i < at.net.n && mask >> (k % 2) & 1 ? 0 : 7));
  }
}

TEST_CASE("what is held is put where it is at the time asked for; what rests has no velocity in a state", "[constraints]") {
  HeldNetwork at(NET);
  Constraints& c = at.constraints;
  const PetscInt count = at.net.n + at.net.ghosts;
  const double t = 1.5;
  for (const bool at_rest : {false, true}) {
    Loads loads;
    loads.at_rest = at_rest;
    c.set_loads(loads);
    std::vector<double> states(static_cast<std::size_t>(4 * count), 7);
    c.place(t, 0, count, states.data());
    for (PetscInt i = 0; i < count; ++i) {
      const double* x0 = at.net.held.data() + 2 * i;
      std::vector<double> expected = {7, 7, 7, 7};
      if (x0[0] < 0.5) expected = {x0[0], x0[1], 0, 0};
      else if (x0[0] > 5.5) expected = {x0[0] + 0.3 * t, x0[1] - 0.2 * t, at_rest ? 0 : 0.3, at_rest ? 0 : -0.2};
      else if (x0[1] < 0.5) expected = {7, x0[1], 7, 0};
      for (std::size_t k = 0; k < 4; ++k) REQUIRE(states[static_cast<std::size_t>(4 * i) + k] == Approx(expected[k]).margin(1e-14));
    }
  }
  const PetscScalar* a = nullptr;
  Vec shown = nullptr;
  REQUIRE(c.stop(at.y) == 0);
  REQUIRE(c.show(t, at.y, &shown) == 0);
  REQUIRE(shown != at.y.get());
  REQUIRE(VecGetArrayRead(shown, &a) == 0);
  for (PetscInt i = 0; i < at.net.n; ++i) {
    const double* x0 = at.net.held.data() + 2 * i;
    // what is fixed is shown as the state has it
    const double x = x0[0] > 5.5 ? x0[0] + 0.3 * t : at.entry(at.net.first + i, 0, 0);
    REQUIRE(a[4 * i] == Approx(x).margin(1e-14));
    if (x0[1] < 0.5 && x0[0] > 0.5 && x0[0] < 5.5) REQUIRE(a[4 * i + 3] == 0);
  }
  REQUIRE(VecRestoreArrayRead(shown, &a) == 0);
}

TEST_CASE("rows and columns of a roller's held component are those of a diagonal matrix", "[constraints]") {
  const HeldNetwork at(NET);
  RowPattern pattern;
  pattern.create(at.net);
  std::vector<double> room;
  for (PetscInt i = 0; i < at.net.n; ++i) {
    const PetscInt count = pattern.count(i), width = 4 * count;
    if (at.net.fixed[static_cast<std::size_t>(i)]) continue;
    const std::vector<double> panel(static_cast<std::size_t>(2 * width), 7);
    const double* rows = complete_rows(at.net, pattern, i, 4, nullptr, 3, panel.data(), &room);
    for (PetscInt s = 0; s < count; ++s) {
      const auto local = std::find(at.net.global.begin(), at.net.global.end(), pattern.columns(i)[s]) - at.net.global.begin();
      const bool own = local == i;
      for (int r = 0; r < 2; ++r)
        for (int k = 0; k < 4; ++k) {
          const bool held = at.constraints.held(i) >> r & 1 || at.constraints.held(static_cast<PetscInt>(local)) >> (k % 2) & 1;
          REQUIRE(rows[r * width + 4 * s + k] == (!held ? 7 : own && k == 2 + r && at.constraints.held(i) >> r & 1 ? 3 : 0));
        }
    }
  }
}

TEST_CASE("a motion that jumps is foreseen by the rank that has its particle, and known to all", "[constraints]") {
  OptionTexts texts = NET;
  texts["-bs_motion_right"] = "x=expression:0.1*step(t-0.5)";
  const HeldNetwork at(texts);
  std::string text;
  REQUIRE(at.constraints.foresee(0, 0.4, &text) == 0);
  CHECK(text.empty());
  REQUIRE(at.constraints.foresee(0.4, 0.6, &text) == 0);
  CHECK((text.find("option -bs_motion_right: the motion of particle ") == 0 && text.find(" jumps at t = 0.5 s") != std::string::npos));
}

TEST_CASE("bodies that nothing holds go back to where they were; one on rollers along the other axis alone", "[constraints]") {
  HeldNetwork at({{"-bs_lattice_type", "square"}, {"-bs_lattice_size", "7,5"}, {"-bs_group_floor", "ids:1-3"}, {"-bs_motion_floor", "y=fixed"}});
  Network& net = at.net;
  const auto right = [&](PetscInt i) { return net.held[static_cast<std::size_t>(2 * i)] > 3.5; };
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e)
      if (right(i) != right(net.links.other[e])) net.links.stiffness[e] = 0;  // no spring there: two bodies
  FreeBodies bodies;
  PetscInt free = -1;
  std::vector<double> load(static_cast<std::size_t>(2 * net.n), 0.0);
  REQUIRE(bodies.count(net, 0, load, false, &free) == 0);
  CHECK(free == 1);
  VecHandle from;
  REQUIRE(VecDuplicate(at.y, from.out()) == 0);
  REQUIRE(VecCopy(at.y, from) == 0);
  const double A[4] = {1, 0, 0, 1}, h = 0.5;
  PetscScalar* a = nullptr;
  REQUIRE(VecGetArray(at.y, &a) == 0);
  for (PetscInt i = 0; i < net.n; ++i)
    for (int c = 0; c < 2; ++c) a[4 * i + c] += 0.25 * (1 + c);
  REQUIRE(VecRestoreArray(at.y, &a) == 0);
  REQUIRE(bodies.pull_back(0, A, h, from, at.y) == 0);
  const PetscScalar* b = nullptr;
  REQUIRE(VecGetArrayRead(at.y, &b) == 0);
  for (PetscInt i = 0; i < net.n; ++i) {
    const double left[4] = {0, 0.5, -0.25 / h, 0}, whole[4] = {0, 0, -0.25 / h, -0.5 / h};
    for (PetscInt k = 0; k < 4; ++k) REQUIRE(b[4 * i + k] == Approx(at.entry(net.first + i, k, 0) + (right(i) ? whole : left)[k]).margin(1e-13));
  }
  REQUIRE(VecRestoreArrayRead(at.y, &b) == 0);

  for (PetscInt i = 0; i < net.n; ++i) load[static_cast<std::size_t>(2 * i)] = right(i) ? 1 : 0;
  REQUIRE(bodies.count(net, 0, load, true, &free) == 0);  // something else may hold it
  const PetscErrors quiet(PETSC_COMM_WORLD);
  REQUIRE(bodies.count(net, 0, load, false, &free) == ERR_FAILED);
  CHECK(last_error(PETSC_COMM_WORLD).text.find("nothing holds particle 4 ") != std::string::npos);
  clear_error(PETSC_COMM_WORLD);
}
