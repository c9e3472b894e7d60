// Springs break at accepted states when they are past their limit, at both of their ends, and become whole again when a step is taken back.
#include "systems/particles/breaking/breaking.hpp"
#include <cmath>
#include "options.hpp"
#include "spoken.hpp"
#include "systems/mechanics.hpp"
#include "systems/particles/breaking/rules.hpp"

using namespace bs;

namespace {

/// A chain of 8 particles, 1 apart, springs of stiffness 2.
struct Chain {
  std::unique_ptr<Model> model;
  VecHandle y;
  explicit Chain(std::initializer_list<OptionTexts::value_type> more) {
    OptionTexts texts(more);
    texts.insert({{"-bs_lattice_type", "chain"},
                  {"-bs_lattice_size", "8"},
                  {"-bs_lattice_dim", "1"},
                  {"-bs_lattice_stiffness", "2"},
                  {"-bs_partition", "rows"}});
    model = model_of(texts);
    REQUIRE(VecDuplicate(model->initial_state(), y.out()) == 0);
  }
  /// Every spring but those of rows in `more` has the strain `all`; those have 0.5 more.
  void stretch(double all, const std::vector<int>& more) {
    const Layout at = layout_of(y);
    const PetscScalar* start = nullptr;
    PetscScalar* a = nullptr;
    REQUIRE(VecGetArrayRead(model->initial_state(), &start) == 0);
    REQUIRE(VecGetArray(y, &a) == 0);
    for (PetscInt i = 0; i < at.particles; ++i) {
      const int row = static_cast<int>(std::lround(start[at.x(i)]));
      double x = row * (1 + all);
      for (const int spring : more) x += row > spring ? 0.5 : 0;
      a[at.x(i)] = x;
      a[at.v(i)] = 0;
    }
    REQUIRE(VecRestoreArray(y, &a) == 0);
    REQUIRE(VecRestoreArrayRead(model->initial_state(), &start) == 0);
  }
  std::vector<double> forces(double t) {
    const double* f = nullptr;
    REQUIRE(model->mechanics()->force(t, y, &f) == 0);
    return {f, f + layout_of(y).particles};
  }
  Breaks& breaks() { return *model->breaks(); }
  /// Rows of the springs that broke, in the order in which they did; on rank 0.
  std::vector<std::int64_t> rows() {
    std::vector<Dataset> tables;
    REQUIRE(breaks().tables(&tables) == 0);
    for (const Dataset& one : tables)
      if (one.path == "/events/broken/spring") return std::get<std::vector<std::int64_t>>(one.rows);
    return {};
  }
  void lists(const std::vector<std::int64_t>& expected) {
    if (rank_of(PETSC_COMM_WORLD) == 0) CHECK(rows() == expected);
  }
};

double size_of_forces(const std::vector<double>& f) {
  double most = 0;
  for (const double one : f) most = std::max(most, std::abs(one));
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  return most;
}

}  // namespace

TEST_CASE("a spring breaks at its limit and not below, whichever limit it is") {
  // strain 0.6, force 2 * 0.6, energy 0.36
  for (const auto& [option, limit] :
       std::vector<std::pair<std::string, double>>{{"-bs_break_strain", 0.6}, {"-bs_break_force", 1.2}, {"-bs_break_energy", 0.36}}) {
    for (const double part : {1.001, 0.999}) {
      Chain chain({{option, std::to_string(limit * part)}});
      INFO(option << " " << part);
      chain.stretch(0.1, {3});
      REQUIRE(chain.model->accept({}, chain.y) == 0);
      CHECK(chain.breaks().broke() == (part < 1 ? 1 : 0));
      CHECK(chain.breaks().any() == (part < 1));
      if (part > 1) continue;
      chain.lists({3});
      chain.stretch(0, {3});
      CHECK(size_of_forces(chain.forces(1)) < 1e-12);  // it exerts no force on either end
    }
  }
}

TEST_CASE("a limit counts on the side that is asked for") {
  for (const char* side : {"tension", "compression", "both"}) {
    Chain chain({{"-bs_break_strain", "0.3"}, {"-bs_break_in", side}});
    INFO(side);
    chain.stretch(-0.4, {2, 5});  // those are stretched by 0.1
    REQUIRE(chain.model->accept({}, chain.y) == 0);
    CHECK(chain.breaks().broke() == (std::string(side) == "tension" ? 0 : 5));
    chain.stretch(0, {2, 5});
    REQUIRE(chain.model->accept({1, 1, 1}, chain.y) == 0);
    CHECK(chain.breaks().broke() == (std::string(side) == "compression" ? 0 : 2));
  }
}

TEST_CASE("a step that is taken back makes its springs whole") {
  Chain chain({{"-bs_break_strain", "0.3"}});
  chain.stretch(0.1, {4});
  const std::vector<double> whole = chain.forces(0);
  std::map<std::string, double> sums;
  chain.model->save_sums(&sums);
  chain.breaks().mark();
  REQUIRE(chain.model->accept({}, chain.y) == 0);
  REQUIRE(chain.breaks().broke() == 1);
  int differs = chain.forces(1) != whole;
  MPI_Allreduce(MPI_IN_PLACE, &differs, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
  CHECK(differs == 1);
  chain.breaks().revert();
  chain.model->restore_sums(sums);
  CHECK(chain.forces(2) == whole);
  CHECK_FALSE(chain.breaks().any());
  chain.lists({});
}

TEST_CASE("one spring at a time: the one farthest past its limit, the first row among equals") {
  Chain chain({{"-bs_break_strain", "0.3"}, {"-bs_break", "worst"}});
  chain.stretch(0.1, {6, 2, 4, 4});  // spring 4 by 1, the others by 0.5
  for (int k = 0; k < 3; ++k) {
    REQUIRE(chain.model->accept({}, chain.y) == 0);
    CHECK(chain.breaks().broke() == 1);
  }
  chain.lists({4, 2, 6});
  REQUIRE(chain.model->accept({}, chain.y) == 0);
  CHECK(chain.breaks().broke() == 0);
}

TEST_CASE("limits that scatter depend on the row and the seed alone") {
  BreakRules rules;
  rules.scatter = BreakRules::uniform;
  rules.width = 0.2;
  rules.seed = 5;
  double sum = 0, least = 2, most = 0;
  for (std::int64_t row = 0; row < 20000; ++row) {
    const double factor = rules.factor(row);
    CHECK(factor == rules.factor(row));
    sum += factor;
    least = std::min(least, factor);
    most = std::max(most, factor);
  }
  CHECK(sum / 20000 == Approx(1).epsilon(5e-3));
  CHECK((least >= 0.8 && least < 0.801 && most <= 1.2 && most > 1.199));
  const double before = rules.factor(7);
  rules.seed = 6;
  CHECK(rules.factor(7) != before);
  // Weibull: the median is (ln 2)^(1/M)
  rules.scatter = BreakRules::weibull;
  rules.width = 4;
  int below = 0;
  for (std::int64_t row = 0; row < 20000; ++row) below += rules.factor(row) < std::pow(std::log(2.0), 0.25);
  CHECK(below / 20000.0 == Approx(0.5).margin(0.015));
}
