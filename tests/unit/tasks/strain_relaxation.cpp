// Flows of a box by changes of its components, which strains they are made of, and small systems of equations.
#include "tasks/strain_relaxation.hpp"
#include <catch2/catch.hpp>

using namespace bs;

TEST_CASE("a change of one component of a box is a flow of the space in it") {
  const double F[9] = {2, 0.5, 0, 0, 4, 0, 0, 0, 1};  // rows: F of the box
  double L[9];
  FreeStrain one;
  one.row = 0;
  one.column = 1;
  flow_of(one, F, 3, L);
  // dF F^-1 with dF = e_0 e_1': the second row of F^-1, (0, 1/4, 0), in the first
  const double expected[9] = {0, 0.25, 0, 0, 0, 0, 0, 0, 0};
  for (int k = 0; k < 9; ++k) CHECK(L[k] == Approx(expected[k]).margin(1e-15));
  one.column = 0;
  flow_of(one, F, 3, L);
  CHECK(L[0] == Approx(0.5));
  CHECK(L[1] == Approx(-0.0625));  // the shear that the box has turns a stretch into a flow with a shear of its own
  const std::vector<bool> wanted = strains_of({one}, F, 3);
  CHECK(wanted[static_cast<std::size_t>(component_place(3, 0, 0))]);
  CHECK(wanted[static_cast<std::size_t>(component_place(3, 0, 1))]);
  CHECK_FALSE(wanted[static_cast<std::size_t>(component_place(3, 1, 1))]);
  CHECK_FALSE(wanted[static_cast<std::size_t>(component_place(3, 2, 2))]);
}

TEST_CASE("small systems of equations are solved with pivoting, and singular ones are told") {
  std::vector<double> x;
  const double expected[3] = {1, 2, 1};
  REQUIRE(solve_small({0, 2, 1, 0, 1, 1, 3, 0, -1}, {5, 3, 2}, &x));  // a zero where elimination begins
  for (int k = 0; k < 3; ++k) CHECK(x[static_cast<std::size_t>(k)] == Approx(expected[k]));
  CHECK_FALSE(solve_small({1, 2, 2, 4}, {1, 1}, &x));
}
