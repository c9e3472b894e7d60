// The residual of an equilibrium, the direction in which loads grow, and the verdict on what a solver calls balanced.
#include "systems/equilibrium.hpp"
#include <cmath>
#include "options.hpp"
#include "spoken.hpp"

using namespace bs;

namespace {

const OptionTexts NET = {{"-bs_lattice_type", "square"}, {"-bs_lattice_size", "4,4"},   {"-bs_lattice_perturbation", "0.1"},
                         {"-bs_group_edge", "xmax"},     {"-bs_lattice_fixed", "xmin"}, {"-bs_motion_edge", "velocity:0.3,0.1"},
                         {"-bs_lattice_neighbors", "8"}, {"-bs_gravity", "0,-2"},       {"-bs_partition", "rows"}};

std::unique_ptr<Equilibrium> equilibrium(const LoadRules& rules = {}) {
  auto model = model_of(NET);
  auto out = std::make_unique<Equilibrium>(model->take_mechanics(), rules);
  REQUIRE(out->begin() == 0);
  return out;
}

struct Vectors {
  VecHandle y, ydot, F, other;
  explicit Vectors(Model& model) {
    for (VecHandle* one : {&y, &ydot, &F, &other}) REQUIRE(VecDuplicate(model.initial_state(), one->out()) == 0);
    REQUIRE(VecCopy(model.initial_state(), y) == 0);
    PetscScalar* a = nullptr;
    PetscInt n = 0, first = 0;
    REQUIRE(VecGetLocalSize(y, &n) == 0);
    REQUIRE(VecGetOwnershipRange(y, &first, nullptr) == 0);
    REQUIRE(VecGetArray(y, &a) == 0);
    for (PetscInt k = 0; k < n; ++k) a[k] += 0.05 * std::sin(1.7 * static_cast<double>(first + k));
    REQUIRE(VecRestoreArray(y, &a) == 0);
    REQUIRE(VecZeroEntries(ydot) == 0);
  }
};

std::vector<double> values(Vec v) {
  const PetscScalar* a = nullptr;
  PetscInt n = 0;
  REQUIRE(VecGetLocalSize(v, &n) == 0);
  REQUIRE(VecGetArrayRead(v, &a) == 0);
  std::vector<double> out(a, a + n);
  REQUIRE(VecRestoreArrayRead(v, &a) == 0);
  return out;
}

}  // namespace

TEST_CASE("the residual of an equilibrium is -f of the loads of its factor, whatever the velocities") {
  const auto model = equilibrium();
  const auto motion = model_of(NET);
  Vectors of(*model);
  const Layout at = layout_of(of.y);
  for (const double s : {0.0, 0.4, 1.0}) {
    // by the model of motion: the same net at time s with gravity s times as strong and all at rest
    Loads loads;
    loads.gravity = s;
    loads.at_rest = true;
    motion->mechanics()->set_loads(loads);
    REQUIRE(VecCopy(of.y, of.other) == 0);
    REQUIRE(zero_velocities(of.other) == 0);
    const double* f = nullptr;
    REQUIRE(motion->mechanics()->force(s, of.other, &f) == 0);
    REQUIRE(model->residual(s, of.y, of.ydot, Form::momentum, of.F) == 0);
    const std::vector<double> F = values(of.F), y = values(of.y);
    INFO("load factor " << s);
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) {
        CHECK(F[static_cast<std::size_t>(at.v(i, c))] == Approx(-f[i * at.dim + c]).epsilon(1e-13).margin(1e-14));
        const double m = model->mechanics()->masses()[static_cast<std::size_t>(i)];
        CHECK(F[static_cast<std::size_t>(at.x(i, c))] == -m * y[static_cast<std::size_t>(at.v(i, c))]);
      }
  }
}

TEST_CASE("what is left of the forces, and the inertia of a motion: none where there is no motion") {
  const auto model = equilibrium();
  const Layout at = layout_of(model->initial_state());
  Vectors of(*model);
  REQUIRE(model->residual(0.5, of.y, of.ydot, Form::momentum, of.F) == 0);
  const std::vector<double> F = values(of.F);
  double squares = 0, left = 0, inertia = -1;
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) squares += std::pow(F[static_cast<std::size_t>(at.v(i, c))], 2);
  MPI_Allreduce(MPI_IN_PLACE, &squares, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  for (const double h : {0.0, 0.5, 0.0}) {  // before there has been one, and after
    REQUIRE(model->set_motion(h, model->initial_state()) == 0);
    REQUIRE(model->step_forces(of.y, of.F, &left, &inertia) == 0);
    CHECK(left == Approx(std::sqrt(squares)).epsilon(1e-12));
    if (h == 0) CHECK(inertia == 0);
    else CHECK(inertia > 0);
  }
}

TEST_CASE("loads that do not grow act in full from the start") {
  LoadRules rules;
  rules.gravity = rules.driven = false;
  const auto grown = equilibrium(), full = equilibrium(rules);
  Vectors of(*grown);
  REQUIRE(grown->residual(1, of.y, of.ydot, Form::momentum, of.F) == 0);
  const std::vector<double> at_full = values(of.F);
  for (const double s : {0.0, 0.5}) {
    REQUIRE(full->residual(s, of.y, of.ydot, Form::momentum, of.F) == 0);
    CHECK(values(of.F) == at_full);
    REQUIRE(grown->residual(s, of.y, of.ydot, Form::momentum, of.F) == 0);
    CHECK((size_of(PETSC_COMM_WORLD) > 1 || values(of.F) != at_full));
  }
  grown->set_factor(1);  // whatever the time
  REQUIRE(grown->residual(0.5, of.y, of.ydot, Form::momentum, of.F) == 0);
  CHECK(values(of.F) == at_full);
}

TEST_CASE("the load direction is the change of the force with the factor") {
  const auto model = equilibrium();
  Vectors of(*model);
  constexpr double S = 0.6, DS = 1e-4;
  REQUIRE(model->load_direction(S, of.y, of.other) == 0);
  REQUIRE(model->residual(S + DS, of.y, of.ydot, Form::momentum, of.F) == 0);
  const std::vector<double> high = values(of.F), q = values(of.other);
  REQUIRE(model->residual(S - DS, of.y, of.ydot, Form::momentum, of.F) == 0);
  const std::vector<double> low = values(of.F);
  const Layout at = layout_of(of.y);
  double most = 0;
  at.for_each([&](PetscInt x, PetscInt v) {
    const auto k = static_cast<std::size_t>(v);
    CHECK(q[static_cast<std::size_t>(x)] == 0);
    CHECK(q[k] == Approx(-(high[k] - low[k]) / (2 * DS)).epsilon(1e-5).margin(1e-6));
    most = std::max(most, std::abs(q[k]));
  });
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  CHECK(most > 1.9);  // gravity, at least
}

TEST_CASE("what leaves a force is no equilibrium") {
  auto model = model_of({{"-bs_lattice_type", "chain"},
                         {"-bs_lattice_size", "3"},
                         {"-bs_lattice_dim", "1"},
                         {"-bs_lattice_stiffness", "4"},
                         {"-bs_lattice_fixed_particles", "0,2"},
                         {"-bs_gravity", "-1"},
                         {"-bs_partition", "rows"}});
  Equilibrium balance(model->take_mechanics(), {});
  REQUIRE(balance.begin() == 0);
  VecHandle y;
  REQUIRE(VecDuplicate(balance.initial_state(), y.out()) == 0);
  const auto with_middle_at = [&](double u) {
    const Layout at = layout_of(y);
    PetscScalar* a = nullptr;
    REQUIRE(VecCopy(balance.initial_state(), y) == 0);
    REQUIRE(VecGetArray(y, &a) == 0);
    for (PetscInt i = 0; i < at.particles; ++i)
      if (balance.mechanics()->linearisation().moves(i, 0)) a[at.x(i)] += u;
    REQUIRE(VecRestoreArray(y, &a) == 0);
  };
  std::string why;
  bool hopeless = false;
  Balance now;
  with_middle_at(-1.0 / 8);  // two springs of stiffness 4 bear the weight 1
  REQUIRE(balance.examine(1, y, &why, &hopeless) == 0);
  CHECK(why.empty());
  REQUIRE(balance.balance(1, y, &now) == 0);
  CHECK(now.left < 1e-14);
  CHECK(now.outer == Approx(1.0).epsilon(0.6));
  with_middle_at(-1.0 / 8 + 1e-4);
  REQUIRE(balance.balance(1, y, &now) == 0);
  CHECK(now.left == Approx(8e-4).epsilon(1e-9));
  REQUIRE(balance.examine(1, y, &why, &hopeless) == 0);
  CHECK_FALSE(why.empty());
  with_middle_at(-0.5 / 8);  // of half of the load
  REQUIRE(balance.examine(0.5, y, &why, &hopeless) == 0);
  CHECK(why.empty());
}
