// States of a rank's particles and ghosts against the entries of the vector that they were gathered from, and motions in closed form.
#include "systems/particles/local_state.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include "held_network.hpp"

using namespace bs;

namespace {

const OptionTexts net = {{"-bs_lattice_type", "square"}, {"-bs_lattice_size", "7,5"}};

OptionTexts with(OptionTexts base, const OptionTexts& more) {
  base.insert(more.begin(), more.end());
  return base;
}

/// Of local particle i, block 2d: what the vector says.
std::vector<double> in_vector(const HeldNetwork& at, PetscInt i, int turn) {
  std::vector<double> out;
  for (PetscInt k = 0; k < 2 * at.net.dim; ++k) out.push_back(at.entry(at.net.global[static_cast<std::size_t>(i)], k, turn));
  return out;
}

/// Where local particle i started, whose row in the input tells its place in a square lattice of unit spacing.
void require_state(const LocalState& state, PetscInt i, const std::vector<double>& expected) {
  for (std::size_t k = 0; k < expected.size(); ++k) REQUIRE(state.at(i)[k] == Approx(expected[k]).epsilon(1e-14).margin(1e-14));
}

}  // namespace

TEST_CASE("every local particle has the entries of its own block of the vector", "[local_state]") {
  HeldNetwork at(with(net, {{"-bs_lattice_damping", "1"}}));
  LocalState state;
  REQUIRE_FALSE(state.created());
  REQUIRE(state.create(at.net, at.y) == 0);
  for (int turn = 0; turn < 3; ++turn) {
    at.fill(turn);
    REQUIRE(state.gather(0.5, at.y) == 0);
    for (PetscInt i = 0; i < at.net.n + at.net.ghosts; ++i)
      for (PetscInt k = 0; k < 4; ++k) REQUIRE(state.at(i)[k] == in_vector(at, i, turn)[static_cast<std::size_t>(k)]);
  }
}

TEST_CASE("velocities of ghosts travel where a damper of any rank needs them", "[local_state]") {
  HeldNetwork at(net);
  LocalState state;
  REQUIRE(state.create(at.net, at.y) == 0);
  REQUIRE(state.gather(0, at.y) == 0);
  for (PetscInt i = at.net.n; i < at.net.n + at.net.ghosts; ++i)
    for (PetscInt k = 0; k < 4; ++k) REQUIRE(state.at(i)[k] == (k < 2 ? in_vector(at, i, 0)[static_cast<std::size_t>(k)] : 0));
}

TEST_CASE("owned states are known to be the same while the vector is", "[local_state]") {
  HeldNetwork at(net);
  LocalState state;
  REQUIRE(state.create(at.net, at.y) == 0);
  REQUIRE(state.gather(0, at.y) == 0);
  const std::uint64_t first = state.version();
  REQUIRE(state.gather(1, at.y) == 0);  // of nothing that depends on time
  CHECK(state.version() == first);
  VecHandle copy;
  REQUIRE(VecDuplicate(at.y, copy.out()) == 0);
  REQUIRE(VecCopy(at.y, copy) == 0);
  REQUIRE(state.gather(1, copy) == 0);  // bit for bit the same
  CHECK(state.version() == first);
  at.fill(1);
  REQUIRE(state.gather(1, at.y) == 0);
  CHECK((state.version() != first || at.net.n == 0));
  for (PetscInt i = 0; i < at.net.n; ++i) REQUIRE(state.at(i)[0] == in_vector(at, i, 1)[0]);
}

TEST_CASE("fixed particles stand where they started, at rest; a direction is 0 there", "[local_state]") {
  HeldNetwork at(with(net, {{"-bs_lattice_fixed", "xmin"}, {"-bs_lattice_damping", "1"}}));
  LocalState state;
  REQUIRE(state.create(at.net, at.y) == 0);
  REQUIRE(state.gather(0, at.y) == 0);
  int held = 0;
  for (PetscInt i = 0; i < at.net.n + at.net.ghosts; ++i) {
    const double *x0 = at.net.held.data() + 2 * i, *s = state.at(i);
    if (!at.net.fixed[static_cast<std::size_t>(i)]) {
      REQUIRE(s[0] == in_vector(at, i, 0)[0]);
      continue;
    }
    held += i < at.net.n;
    REQUIRE(x0[0] == Approx(0).margin(1e-12));
    for (int k = 0; k < 4; ++k) REQUIRE(s[k] == (k < 2 ? x0[k] : 0));
  }
  MPI_Allreduce(MPI_IN_PLACE, &held, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(held == 5);
  REQUIRE(state.gather_direction(at.y) == 0);
  for (PetscInt i = 0; i < at.net.n + at.net.ghosts; ++i)
    for (PetscInt k = 0; k < 4; ++k)
      REQUIRE(state.at(i)[k] == (at.net.fixed[static_cast<std::size_t>(i)] ? 0 : in_vector(at, i, 0)[static_cast<std::size_t>(k)]));
}

TEST_CASE("driven particles are where their motion takes them, free components where the vector says", "[local_state]") {
  HeldNetwork at(with(net, {{"-bs_group_right", "xmax"},
                            {"-bs_motion_right", "velocity:0.3,-0.2"},
                            {"-bs_group_left", "xmin"},
                            {"-bs_motion_left", "y=sinusoid:0.5,0.25,0.1"},
                            {"-bs_lattice_damping", "1"}}));
  LocalState state;
  REQUIRE(state.create(at.net, at.y) == 0);
  const double pi = std::acos(-1.0);
  const auto check = [&](double t, bool velocities) {
    for (PetscInt i = 0; i < at.net.n + at.net.ghosts; ++i) {
      std::vector<double> expected = in_vector(at, i, 0);
      const double x0 = at.net.held[static_cast<std::size_t>(2 * i)], y0 = at.net.held[static_cast<std::size_t>(2 * i + 1)];
      if (x0 > 5.5) expected = {x0 + 0.3 * t, y0 - 0.2 * t, 0.3, -0.2};
      if (x0 < 0.5) {
        expected[1] = y0 + 0.5 * std::sin(2 * pi * 0.25 * t + 0.1);
        expected[3] = 0.5 * 2 * pi * 0.25 * std::cos(2 * pi * 0.25 * t + 0.1);
      }
      if (!velocities) expected.resize(2);
      require_state(state, i, expected);
    }
  };
  REQUIRE(state.gather(1.7, at.y) == 0);
  check(1.7, true);
  REQUIRE(state.gather(2.9, at.y) == 0);  // of the same vector at another time
  check(2.9, true);
  const std::uint64_t before = state.version();
  state.drive_to(0.4);
  check(0.4, true);
  CHECK((state.version() != before || at.net.n == 0));
  REQUIRE(state.gather_direction(at.y) == 0);
  for (PetscInt i = 0; i < at.net.n + at.net.ghosts; ++i) {
    const double x0 = at.net.held[static_cast<std::size_t>(2 * i)];
    for (PetscInt k = 0; k < 4; ++k)
      REQUIRE(state.at(i)[k] == (x0 > 5.5 || (x0 < 0.5 && k % 2 == 1) ? 0 : in_vector(at, i, 0)[static_cast<std::size_t>(k)]));
  }
}

TEST_CASE("images stand apart from their particles by edges of the strained box, and move with them", "[local_state]") {
  HeldNetwork at(with(net, {{"-bs_lattice_periodic", "xy"}, {"-bs_box_strain", "xy=velocity:0.25,xx=velocity:-0.1"}, {"-bs_lattice_damping", "2"}}));
  LocalState state;
  REQUIRE(state.create(at.net, at.y) == 0);
  int images = 0;
  const auto check = [&](double t, double velocity) {
    for (PetscInt i = 0; i < at.net.n + at.net.ghosts; ++i) {
      std::vector<double> expected = in_vector(at, i, 0);
      if (i >= at.net.n) {
        const int* s = at.net.image.data() + 2 * (i - at.net.n);
        // e_x = (7 (1 - 0.1 t), 0), e_y = (5 * 0.25 t, 5)
        expected[0] += s[0] * 7 * (1 - 0.1 * t) + s[1] * 1.25 * t;
        expected[1] += s[1] * 5;
        expected[2] += velocity * (s[0] * -0.7 + s[1] * 1.25);
        images += s[0] != 0 || s[1] != 0;
      }
      require_state(state, i, expected);
    }
  };
  REQUIRE(state.gather(0.8, at.y) == 0);
  check(0.8, 1);
  MPI_Allreduce(MPI_IN_PLACE, &images, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(images >= 2 * (7 + 5) + 4);  // a ring round the box, on one rank
  REQUIRE(state.gather(2, at.y) == 0);
  check(2, 1);
  state.drive_to(0.5);
  check(0.5, 1);  // these rates do not depend on time
  REQUIRE(state.gather_direction(at.y) == 0);
  for (PetscInt i = 0; i < at.net.n + at.net.ghosts; ++i)
    for (PetscInt k = 0; k < 4; ++k) REQUIRE(state.at(i)[k] == in_vector(at, i, 0)[static_cast<std::size_t>(k)]);
}
