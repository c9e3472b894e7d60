// Lattices in memory: what of the arrays becomes rows, and what is refused.
#include <catch2/catch.hpp>

#include <cmath>

#include "lattice/lattice_arrays.hpp"

using namespace bs;

namespace {

LatticeArrays triangle() {
  LatticeArrays a;
  a.dim = 2;
  a.position = {0, 0, 1, 0, 0, 1};
  a.mass = {1, 2, 3};
  a.springs = {0, 1, 1, 2};
  a.stiffness = {10, 20};
  return a;
}

std::string refusal(const LatticeArrays& arrays) {
  Lattice l;
  std::string error;
  return lattice_of(arrays, &l, &error) ? std::string() : error;
}

}  // namespace

TEST_CASE("arrays in memory become rows, with what is left out filled in") {
  LatticeArrays a = triangle();
  Lattice l;
  std::string error;
  REQUIRE(lattice_of(a, &l, &error));
  REQUIRE((l.particles.total == 3 && l.springs.total == 2 && l.dim == 2));
  REQUIRE(l.velocity == std::vector<double>(6, 0.0));
  REQUIRE(l.fixed == std::vector<std::uint8_t>(3, 0));
  REQUIRE((std::isnan(l.rest_length[0]) && std::isnan(l.rest_length[1])));
  REQUIRE(l.damping == std::vector<double>(2, 0.0));
  a.box.periodic[0] = true;
  a.shift = {0, 0, 1, 0};
  a.rest_length = {1, 2};
  a.groups = {{"lower", {1, 1, 0}}};
  REQUIRE(lattice_of(a, &l, &error));
  REQUIRE((l.box.active() && l.shift == a.shift && l.rest_length == a.rest_length && l.groups[0].member[2] == 0));
}

TEST_CASE("arrays whose sizes do not fit are refused by name") {
  REQUIRE(refusal(triangle()).empty());
  LatticeArrays a = triangle();
  a.position.pop_back();
  REQUIRE(refusal(a) == "lattice in memory: position has 5 numbers: give 6");
  a = triangle();
  a.fixed = {1};
  REQUIRE(refusal(a) == "lattice in memory: fixed has 1 number: give 3, or none");
  a = triangle();
  a.groups = {{"lower", {1}}};
  REQUIRE(refusal(a) == "lattice in memory: group lower has 1 number: give 3");
  a = triangle();
  a.dim = 4;
  REQUIRE(refusal(a) == "lattice in memory: dim is 4: give 1, 2 or 3");
  REQUIRE(refusal({}) == "lattice in memory: mass is empty: give at least one particle");
}
