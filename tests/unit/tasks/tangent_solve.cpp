// Linear systems with the tangent of an equilibrium: by the run's solver and by factors, where the equilibrium is stable and where it is a saddle.
#include "tasks/tangent_solve.hpp"
#include "base/vec_array.hpp"
#include "static_case.hpp"

using namespace bs;

namespace {

/// d load/d height, by differences: the stiffness of the arch's apex against a force that pulls it down.
double slope(double height) {
  constexpr double h = 1e-4;
  return (8 * (Arch::load(height + h) - Arch::load(height - h)) - (Arch::load(height + 2 * h) - Arch::load(height - 2 * h))) / (12 * h);
}

}  // namespace

TEST_CASE("an arch's apex moves by its stiffness under a small force, stable or not, and by factors as without them") {
  for (const bool factors : {false, true})
    for (const double height : {0.95, 0.3, -1.2}) {
      StaticCase run(Arch::options("unit_tangent.xsp"), 0.1, 0.1, nullptr);
      REQUIRE(run.solve());
      const Layout at = layout_of(run.state());
      const Linearisation& lin = run.model->mechanics()->linearisation();
      VecHandle load, u;
      REQUIRE(VecDuplicate(run.state(), load.out()) == 0);
      REQUIRE(VecDuplicate(run.state(), u.out()) == 0);
      REQUIRE(VecZeroEntries(load) == 0);
      {
        const WriteArray y(run.state());
        const WriteArray f(load);
        for (PetscInt i = 0; i < at.particles; ++i)
          if (lin.moves(i, 1)) {
            y[at.x(i, 1)] = height;
            f[at.v(i, 1)] = -2;
          }
      }
      TangentSolve solve;
      double left = 0;
      if (factors) solve.use_factors();
      REQUIRE(solve.prepare(run.ts, run.context.matrix, *run.model, 0.1, run.state()) == 0);
      REQUIRE(solve.solve(load, u, 1e-10, &left) == 0);
      REQUIRE(solve.restore_solver() == 0);
      double moved = -1e300;
      {
        const ReadArray a(u);
        for (PetscInt i = 0; i < at.particles; ++i)
          if (lin.moves(i, 1)) moved = a[at.x(i, 1)];
      }
      // K u = -f with K = d load/d height: the springs carry the load
      INFO("height " << height << ", factors " << factors << ", stiffness " << slope(height));
      CHECK(left <= 1e-10);
      CHECK(most_of_ranks(moved) == Approx(2 / slope(height)).epsilon(1e-6));
    }
}

TEST_CASE("no force moves nothing") {
  StaticCase run(Arch::options("unit_tangent.xsp"), 0.1, 0.1, nullptr);
  REQUIRE(run.solve());
  VecHandle load, u;
  REQUIRE(VecDuplicate(run.state(), load.out()) == 0);
  REQUIRE(VecDuplicate(run.state(), u.out()) == 0);
  REQUIRE(VecZeroEntries(load) == 0);
  TangentSolve solve;
  PetscReal size = 1;
  double left = 0;
  REQUIRE(solve.prepare(run.ts, run.context.matrix, *run.model, 0.1, run.state()) == 0);
  REQUIRE(solve.solve(load, u, 1e-10, &left) == 0);
  REQUIRE(solve.restore_solver() == 0);
  CHECK(left == -1);
  REQUIRE(VecNorm(u, NORM_2, &size) == 0);
  CHECK(size == 0);
}
