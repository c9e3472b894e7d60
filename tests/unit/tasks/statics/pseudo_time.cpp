// Pseudo-transient continuation finds the equilibrium that Newton's method alone does not; what is no equilibrium stays as it was.
#include "tasks/statics/pseudo_time.hpp"
#include "static_case.hpp"

using namespace bs;

TEST_CASE("below the limit load Newton's method needs no help") {
  PseudoTime pseudo;
  StaticCase run(Arch::options("unit_pseudo.xsp"), 0.3, 0.3,
                 [&](TS ts, TSContext& context, Equilibrium& model) { return pseudo.attach(ts, context, model, 0.3); });
  REQUIRE(run.solve());
  CHECK(pseudo.is_newton());
  CHECK(pseudo.solves() == 0);
  CHECK(Arch::load(run.place(1)) == Approx(0.3).epsilon(1e-10));
  CHECK(run.place(1) > 0.5);
}

TEST_CASE("a state that is no equilibrium relaxes downhill to one, by pseudo time where Newton's method fails") {
  for (const bool newton : {true, false}) {
    PseudoTime pseudo;
    OptionTexts texts = Arch::options("unit_pseudo.xsp");
    if (!newton) texts["-snes_max_it"] = "2";
    StaticCase run(texts, 0.01, 0.01, [&](TS ts, TSContext& context, Equilibrium& model) { return pseudo.attach(ts, context, model, 0.01); });
    REQUIRE(run.solve());  // a short load step, to have a stage
    const Layout at = layout_of(run.state());
    const Linearisation& lin = run.model->mechanics()->linearisation();
    PetscScalar* a = nullptr;
    REQUIRE(VecGetArray(run.state(), &a) == 0);
    for (PetscInt i = 0; i < at.particles; ++i)
      if (lin.moves(i, 1)) a[at.x(i, 1)] = -0.2;  // between the saddle near 0 and the inverted arch
    REQUIRE(VecRestoreArray(run.state(), &a) == 0);
    bool good = false;
    REQUIRE(pseudo.relax(run.state(), &good) == 0);
    REQUIRE(good);
    INFO((newton ? "Newton" : "pseudo time"));
    CHECK(Arch::load(run.place(1)) == Approx(0.01).epsilon(1e-8));
    CHECK(run.place(1) < -0.9);
    CHECK((pseudo.solves() > 0) == !newton);
    CHECK(pseudo.at_load_step());
  }
}
