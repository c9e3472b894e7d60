// The first iterate by sub-steps lies where the step's potential is lowest on the way, and on the method's own relation of positions and velocities.
#include "time/implicit/substep_guess.hpp"
#include <cmath>
#include <vector>
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/newton/search/energy.hpp"
#include "static_case.hpp"
#include "time/stepper.hpp"

using namespace bs;

namespace {

constexpr double H = 0.5, K = 100, REST = 12, HALF = 10;

struct Point2 {
  double x = 0, y = 0;
};

/// A particle of mass 1 between two fixed ones 20 apart, on springs of rest length 12: pressed, it goes aside. It starts at (10, 0.01) with (0, 0.1).
struct Pressed {
  Pressed(const std::string& guess, OptionTexts more = {}) : given(options(guess, std::move(more))) {
    static const bool registered = register_condensed() == 0 && register_searches() == 0;
    REQUIRE(registered);
    REQUIRE(create_model(PETSC_COMM_WORLD, &model) == 0);
    context.pace = {H, 10 * H, 1e-10};
    REQUIRE(create_ts(*model, &context, &ts) == 0);
    stepper = std::make_unique<Stepper>(
        *model, context, StepOptions{}, [](const StepRecord&) { return 0; }, [](PetscInt, double, Vec) { return 0; }, [] { return 0; },
        [] { return 0; });
    REQUIRE(stepper->attach(ts) == 0);
    REQUIRE(create_inner_solver(ts, context) == 0);
    REQUIRE(TSSetUp(ts) == 0);
    REQUIRE(stepper->attach_solvers(ts) == 0);
    SNES snes = nullptr;
    REQUIRE(TSGetSNES(ts, &snes) == 0);
    REQUIRE(SNESMonitorSet(
                snes, [](SNES of, PetscInt it, PetscReal, void* self) { return static_cast<Pressed*>(self)->look(of, it); }, this, nullptr) == 0);
  }
  static OptionTexts options(const std::string& guess, OptionTexts more) {
    more.insert({{"-bs_lattice_file", scene_file("pressed.xsp",
                                                 "#1.0\nmass 1 0 0 0 0 -1 1\nmass 2 10 0.01 0 0.1 1 1\nmass 3 20 0 0 0 -1 1\n"
                                                 "spng 1 1 2 100 0 12\nspng 2 2 3 100 0 12\n")},
                 {"-bs_guess", guess}});
    return more;
  }
  void steps(int count) {
    REQUIRE(TSSetMaxSteps(ts, count) == 0);
    REQUIRE(TSSolve(ts, nullptr) == 0);
  }
  PetscErrorCode look(SNES snes, PetscInt it) {
    Vec X = nullptr;
    PetscFunctionBegin;
    if (it > 0) PetscFunctionReturn(0);
    PetscCall(SNESGetSolution(snes, &X));
    first_x.push_back(of(X, false));
    first_v.push_back(of(X, true));
    Vec y = nullptr;
    PetscCall(TSGetSolution(ts, &y));
    start_x.push_back(of(y, false));
    start_v.push_back(of(y, true));
    PetscFunctionReturn(0);
  }
  /// Position or velocity of the one particle that can move.
  Point2 of(Vec y, bool velocity) const {
    const Linearisation& lin = model->mechanics()->linearisation();
    const Layout at = layout_of(y);
    const ReadArray a(y);
    Point2 p{-1e300, -1e300};
    for (PetscInt i = 0; i < at.particles; ++i)
      if (lin.moves(i, 0)) p = velocity ? Point2{a[at.v(i, 0)], a[at.v(i, 1)]} : Point2{a[at.x(i, 0)], a[at.x(i, 1)]};
    return {most_of_ranks(p.x), most_of_ranks(p.y)};
  }

  Given given;
  std::unique_ptr<Model> model;
  TSContext context;
  TSHandle ts;
  std::unique_ptr<Stepper> stepper;
  std::vector<Point2> first_x, first_v, start_x, start_v;  ///< of each step: Newton's first iterate, the state it starts from
};

/// Phi/sigma of backward Euler at x for a step from (x0, v0) [J].
double potential(Point2 x, Point2 x0, Point2 v0) {
  const double left = std::hypot(x.x, x.y) - REST, right = std::hypot(x.x - 2 * HALF, x.y) - REST;
  const double a = x.x - x0.x - H * v0.x, b = x.y - x0.y - H * v0.y;
  return (a * a + b * b) / (2 * H * H) + 0.5 * K * (left * left + right * right);
}

double lowest(Point2 x0, Point2 v0) {
  double found = potential(x0, x0, v0);
  for (double y = -10; y <= 10; y += 1e-3) found = std::min(found, potential({HALF, y}, x0, v0));
  return found;
}

}  // namespace

TEST_CASE("sub-steps find most of the way down from an unstable state") {
  for (const char* inner : {"cholesky", "bicc"}) {
    INFO(inner);
    Pressed run("substeps", {{"-condensed_pc_type", inner}});
    run.steps(1);
    REQUIRE(run.first_x.size() == 1);
    const Point2 x0 = run.start_x[0], v0 = run.start_v[0], x = run.first_x[0], v = run.first_v[0];
    CHECK(v0.y == 0.1);
    const double top = potential(x0, x0, v0), bottom = lowest(x0, v0);
    CHECK(potential(x, x0, v0) - bottom < 0.05 * (top - bottom));
    CHECK(v.x == Approx((x.x - x0.x) / H).margin(1e-12));
    CHECK(v.y == Approx((x.y - x0.y) / H));
    CHECK(run.context.predictor.substeps() > 0);
    CHECK(run.context.predictor.substeps() <= 16);
  }
}

TEST_CASE("a guess by sub-steps keeps the relation of the trapezoidal rule") {
  Pressed run("substeps", {{"-ts_type", "cn"}});
  run.steps(1);
  const Point2 x0 = run.start_x[0], v0 = run.start_v[0], x = run.first_x[0], v = run.first_v[0];
  CHECK(std::abs(x.y - x0.y) > 0.1);
  CHECK(x.y - x0.y == Approx(0.5 * H * (v.y + v0.y)));
}

TEST_CASE("sub-steps follow the steps that met negative curvature, and no others") {
  Pressed run("auto"), none("extrapolate");
  run.steps(1);
  CHECK(run.context.predictor.substeps() == 0);  // nothing is known before the first step
  run.steps(2);
  CHECK(run.context.predictor.substeps() > 0);
  none.steps(2);
  CHECK(none.context.predictor.substeps() == 0);
  const PetscInt taken = static_cast<PetscInt>(run.context.predictor.substeps());
  run.steps(10);  // it has come to rest at the side
  CHECK(run.context.predictor.substeps() < 9 * 16);
  CHECK(run.context.predictor.substeps() >= taken);
  CHECK(std::abs(run.first_x.back().y) == Approx(std::sqrt(REST * REST - HALF * HALF)).epsilon(0.05));
}

TEST_CASE("a checkpoint keeps that the last step met negative curvature") {
  Pressed run("auto"), other("auto");
  Facts facts, before;
  REQUIRE(run.context.predictor.save(&before) == 0);
  CHECK(before.whole.at("guess_folded") == 0);
  run.steps(1);
  REQUIRE(run.context.predictor.save(&facts) == 0);
  CHECK(facts.whole.at("guess_folded") == 1);
  REQUIRE(other.context.predictor.restore(facts) == 0);
  other.steps(1);
  CHECK(other.context.predictor.substeps() > 0);
}

TEST_CASE("sub-steps that the solver does not offer are refused with what they need") {
  for (const OptionTexts& more :
       {OptionTexts{{"-ts_type", "bdf"}}, OptionTexts{{"-snes_linesearch_type", "bt"}}, OptionTexts{{"-snes_type", "ksponly"}},
        OptionTexts{{"-snes_lag_jacobian", "2"}}, OptionTexts{{"-pc_type", "lu"}}}) {
    const Given given(Pressed::options("substeps", more));
    std::unique_ptr<Model> model;
    REQUIRE(create_model(PETSC_COMM_WORLD, &model) == 0);
    TSContext context;
    TSHandle ts;
    INFO(more.begin()->first);
    const Handled handled;
    Caught said;
    const PetscErrorCode status = create_ts(*model, &context, &ts);
    const std::string text = said.text();
    CHECK(status != 0);
    CHECK((rank_of(PETSC_COMM_WORLD) > 0 || text.find("option -bs_guess substeps: needs ") != std::string::npos));
  }
}
