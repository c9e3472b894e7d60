// A path by arc length follows the closed form of an arch of two bars through both of its limit points.
#include "tasks/statics/arc_length.hpp"
#include "static_case.hpp"

using namespace bs;

TEST_CASE("a path by arc length passes the limit points of an arch and ends at the load asked for") {
  PseudoTime pseudo;
  ArcLength arc;
  StaticCase run(Arch::options("unit_arc.xsp"), 0.05, 20, [&](TS ts, TSContext& context, Equilibrium& model) {
    PetscFunctionBegin;
    PetscCall(pseudo.attach(ts, context, model, 0.05));
    PetscCall(arc.attach(ts, context, model, pseudo, {0.05, 1, false}));
    PetscFunctionReturn(0);
  });
  double most = 0, least = 0, worst = 0, last = 0;
  int turns = 0, steps = 0;
  run.on_step = [&](const StepRecord&) {
    const double s = arc.factor(), height = run.place(1);
    worst = std::max(worst, std::abs(s - Arch::load(height)));
    if (steps == 0) CHECK(s == Approx(0.05).epsilon(0.2));  // the first step is to change s by about that much
    if (steps > 0 && (s > last) != (turns % 2 == 0)) ++turns;
    if (turns == 0) most = std::max(most, s);
    least = std::min(least, s);
    last = s;
    ++steps;
    if (arc.at_end()) return TSSetConvergedReason(run.ts, TS_CONVERGED_USER);
    return PetscErrorCode(0);
  };
  REQUIRE(run.solve());
  CHECK(arc.at_end());
  CHECK(last == Approx(1).epsilon(1e-12));
  CHECK(run.place(1) < -1);
  CHECK(worst < 1e-9);
  CHECK(turns == 2);
  CHECK(most <= Arch::limit());
  CHECK(most > 0.8 * Arch::limit());
  CHECK(least >= -Arch::limit());
  CHECK(least < -0.8 * Arch::limit());
}
