// An unstable direction is found where there is one, and the first step along it goes to less energy.
#include "tasks/statics/saddle_point.hpp"
#include "static_case.hpp"
#include "tasks/statics/pseudo_time.hpp"

using namespace bs;

/// Of the unstable equilibrium of an arch under that load factor, below the one of the limit load: by bisection.
static double saddle_height(double load) {
  double low = 0, high = 0.5;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (Arch::load(middle) < load ? low : high) = middle;
  }
  return low;
}

TEST_CASE("an arch is unstable between its limit points, and the first step away leads downhill") {
  for (const std::string solver : {"cholesky", "none"}) {
    PseudoTime pseudo;
    OptionTexts texts = Arch::options("unit_saddle.xsp");
    texts["-condensed_pc_type"] = solver;
    StaticCase run(texts, 0.3, 0.3, [&](TS ts, TSContext& context, Equilibrium& model) { return pseudo.attach(ts, context, model, 0.3); });
    REQUIRE(run.solve());
    VecHandle z, out;
    REQUIRE(VecDuplicate(run.state(), z.out()) == 0);
    REQUIRE(VecDuplicate(run.state(), out.out()) == 0);
    const Layout at = layout_of(run.state());
    const Linearisation& lin = run.model->mechanics()->linearisation();
    for (const bool stable : {true, false}) {
      if (!stable) {
        PetscScalar* a = nullptr;
        REQUIRE(VecGetArray(run.state(), &a) == 0);
        for (PetscInt i = 0; i < at.particles; ++i)
          if (lin.moves(i, 1)) a[at.x(i, 1)] = saddle_height(0.3);
        REQUIRE(VecRestoreArray(run.state(), &a) == 0);
      }
      PetscInt negative = 0;
      bool found = false, lower = false;
      INFO(solver << (stable ? ", stable" : ", unstable"));
      REQUIRE(find_unstable_direction(run.ts, run.context.matrix, *run.model, 0.3, run.state(), 50, z, &negative, &found) == 0);
      CHECK(negative == (solver == "none" ? -1 : stable ? 0 : 1));
      CHECK(found == !stable);
      if (!found) continue;
      HeldEnergies here, there;
      REQUIRE(step_down(*run.model, 0.3, run.state(), z, out, &lower) == 0);
      REQUIRE(run.model->energies(0.3, run.state(), &here) == 0);
      REQUIRE(run.model->energies(0.3, out, &there) == 0);
      CHECK(lower);
      CHECK(there.potential < here.potential - here.rounding);
    }
  }
}
