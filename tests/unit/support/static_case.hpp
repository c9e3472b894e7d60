// Load steps of a lattice in memory, with what the static task attaches to them.
#pragma once
#include <petscts.h>
#include <catch2/catch.hpp>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include "linalg/condensed/condensed.hpp"
#include "options.hpp"
#include "solvers/newton/search/energy.hpp"
#include "spoken.hpp"
#include "systems/equilibrium.hpp"
#include "systems/layout.hpp"
#include "time/stepper.hpp"

namespace bs {

/// The largest of a number of each rank.
inline double most_of_ranks(double value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  return value;
}

/// Writes a text as rank 0 and gives its name.
inline std::string scene_file(const std::string& name, const std::string& text) {
  if (rank_of(PETSC_COMM_WORLD) == 0) std::ofstream(name) << text;
  MPI_Barrier(PETSC_COMM_WORLD);
  return name;
}

/// A lattice's equilibria, and the TS that steps through them. `attach` is called once the TS has read its options.
struct StaticCase {
  using Attach = std::function<PetscErrorCode(TS, TSContext&, Equilibrium&)>;

  StaticCase(OptionTexts texts, double step, double end, const Attach& attach, const LoadRules& rules = {}) : given(std::move(texts)) {
    static const bool registered = register_condensed() == 0 && register_searches() == 0;
    REQUIRE(registered);
    std::unique_ptr<Model> made;
    REQUIRE(create_model(PETSC_COMM_WORLD, &made) == 0);
    model = std::make_unique<Equilibrium>(made->take_mechanics(), rules);
    REQUIRE(model->begin() == 0);
    context.pace = {step, end, 1e-12};
    REQUIRE(create_ts(*model, &context, &ts) == 0);
    context.newton.iterate_to_rounding(true);
    if (attach) REQUIRE(attach(ts, context, *model) == 0);
    stepper = std::make_unique<Stepper>(
        *model, context, StepOptions{}, [this](const StepRecord& record) { return on_step ? on_step(record) : 0; },
        [](PetscInt, double, Vec) { return 0; }, [] { return 0; }, [] { return 0; });
    REQUIRE(stepper->attach(ts) == 0);
    REQUIRE(create_inner_solver(ts, context) == 0);
    REQUIRE(TSSetUp(ts) == 0);
    REQUIRE(stepper->attach_solvers(ts) == 0);
  }
  /// All load steps; whether they came to their end.
  bool solve() {
    TSConvergedReason reason;
    REQUIRE(TSSolve(ts, nullptr) == 0);
    REQUIRE(TSGetConvergedReason(ts, &reason) == 0);
    return reason > 0;
  }
  Vec state() {
    Vec y = nullptr;
    REQUIRE(TSGetSolution(ts, &y) == 0);
    return y;
  }
  /// Component c of the position of the one particle that can move.
  double place(PetscInt c) {
    const Linearisation& lin = model->mechanics()->linearisation();
    const Layout at = layout_of(state());
    const PetscScalar* a = nullptr;
    double found = -1e300;
    REQUIRE(VecGetArrayRead(state(), &a) == 0);
    for (PetscInt i = 0; i < at.particles; ++i)
      if (lin.moves(i, c)) found = a[at.x(i, c)];
    REQUIRE(VecRestoreArrayRead(state(), &a) == 0);
    return most_of_ranks(found);
  }

  Given given;
  std::unique_ptr<Equilibrium> model;
  TSContext context;
  TSHandle ts;
  std::unique_ptr<Stepper> stepper;
  std::function<PetscErrorCode(const StepRecord&)> on_step;
};

/// Two bars between fixed points 20 apart, of stiffness k = 100, whose apex of mass 1 is 1 above them; gravity 1 pulls it down.
struct Arch {
  static constexpr double K = 100, HALF = 10;
  static double rest() { return std::sqrt(HALF * HALF + 1); }
  static OptionTexts options(const std::string& file) {
    char text[512];
    std::snprintf(text, sizeof text,
                  "#1.0\nmass 1 0 0 0 0 -1 1\nmass 2 10 1 0 0 1 1\nmass 3 20 0 0 0 -1 1\nspng 1 1 2 100 0 %.17g\nspng 2 2 3 100 0 %.17g\n", rest(),
                  rest());
    return {{"-bs_lattice_file", scene_file(file, text)}, {"-bs_gravity", "0,-1"}};
  }
  /// The load factor of the equilibrium in which the apex is that high.
  static double load(double height) {
    const double length = std::hypot(HALF, height);
    return 2 * K * (rest() - length) * height / length;
  }
  /// Its largest value, where length^3 = rest HALF^2.
  static double limit() {
    const double length = std::cbrt(rest() * HALF * HALF);
    return load(std::sqrt(length * length - HALF * HALF));
  }
};

}  // namespace bs
