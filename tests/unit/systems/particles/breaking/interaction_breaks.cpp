// Angle springs break at their limits, at all of their ends, become whole again when a step is taken back, and follow springs.
#include "systems/particles/breaking/interaction_breaks.hpp"
#include <cmath>
#include "options.hpp"
#include "spoken.hpp"
#include "systems/mechanics.hpp"
#include "systems/system.hpp"

using namespace bs;

namespace {

/// A chain of 9 particles, 1 apart, with angle springs of stiffness 2; spring k joins particles k and k + 1, angle k is at particle k + 1.
struct Chain {
  std::unique_ptr<Model> model;
  VecHandle y;
  explicit Chain(std::initializer_list<OptionTexts::value_type> more) {
    OptionTexts texts(more);
    texts.insert({{"-bs_lattice_type", "chain"},
                  {"-bs_lattice_size", "9"},
                  {"-bs_lattice_dim", "2"},
                  {"-bs_angle_stiffness", "2"},
                  {"-bs_partition", "rows"}});
    model = model_of(texts);
    REQUIRE(VecDuplicate(model->initial_state(), y.out()) == 0);
  }
  /// The chain turns by `angle` at particle `at`, and springs from row `longer` on are 1.5 long.
  void bend(int at, double angle, int longer = 99) {
    const Layout layout = layout_of(y);
    const ReadArray start(model->initial_state());
    const WriteArray a(y);
    for (PetscInt i = 0; i < layout.particles; ++i) {
      const int row = static_cast<int>(std::lround(start[layout.x(i)]));
      double x = 0, z = 0;
      for (int k = 0; k < row; ++k) {
        const double l = k >= longer ? 1.5 : 1;
        x += l * std::cos(k >= at ? angle : 0);
        z += l * std::sin(k >= at ? angle : 0);
      }
      a[layout.x(i)] = x;
      a[layout.x(i) + 1] = z;
      a[layout.v(i)] = a[layout.v(i) + 1] = 0;
    }
  }
  std::vector<double> forces(double t) {
    const double* f = nullptr;
    REQUIRE(model->mechanics()->force(t, y, &f) == 0);
    return {f, f + 2 * layout_of(y).particles};
  }
  double force_size(double t) {
    double most = 0;
    for (const double one : forces(t)) most = std::max(most, std::abs(one));
    MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    return most;
  }
  Breaks& breaks() { return *model->breaks(); }
  void lists(const std::string& path, const std::vector<std::int64_t>& expected) {
    std::vector<Dataset> tables;
    std::vector<std::int64_t> found;
    REQUIRE(breaks().tables(&tables) == 0);
    for (const Dataset& one : tables)
      if (one.path == path) found = std::get<std::vector<std::int64_t>>(one.rows);
    if (rank_of(PETSC_COMM_WORLD) == 0) CHECK(found == expected);
  }
};

}  // namespace

TEST_CASE("an angle spring breaks at its limit and not below, in either sense, and exerts nothing then") {
  // change 0.5, moment 1, energy 0.25
  for (const auto& [option, limit] :
       std::vector<std::pair<std::string, double>>{{"-bs_break_angle_change", 0.5}, {"-bs_break_angle_moment", 1}, {"-bs_break_angle_energy", 0.25}})
    for (const double sense : {1, -1})
      for (const double part : {1.001, 0.999}) {
        Chain chain({{option, std::to_string(limit * part)}});
        INFO(option << " " << part << " " << sense);
        chain.bend(4, sense * 0.5);
        CHECK(chain.force_size(0) > 0.9);
        REQUIRE(chain.model->accept({}, chain.y) == 0);
        CHECK(chain.breaks().broke() == (part < 1 ? 1 : 0));
        if (part > 1) continue;
        chain.lists("/events/broken_angles/angle", {3});
        chain.lists("/events/broken_angles/ends", {3, 4, 5});
        CHECK(chain.force_size(1) < 1e-12);
      }
}

TEST_CASE("a step that is taken back makes its angle springs whole") {
  Chain chain({{"-bs_break_angle_change", "0.3"}});
  chain.bend(5, 0.4);
  const std::vector<double> whole = chain.forces(0);
  std::map<std::string, double> sums;
  chain.model->save_sums(&sums);
  chain.breaks().mark();
  REQUIRE(chain.model->accept({}, chain.y) == 0);
  REQUIRE(chain.breaks().broke() == 1);
  CHECK(chain.force_size(1) < 1e-12);
  chain.breaks().revert();
  chain.model->restore_sums(sums);
  CHECK(chain.forces(2) == whole);
  CHECK_FALSE(chain.breaks().any());
  chain.lists("/events/broken_angles/angle", {});
}

TEST_CASE("angle springs follow the springs along their arms where that is asked for") {
  for (const bool asked : {false, true}) {
    Chain chain({{"-bs_break_strain", "0.4"}, {"-bs_break_angle_change", "3"}, {"-bs_break_with_springs", asked ? "true" : "false"}});
    INFO(asked);
    chain.bend(99, 0, 7);  // the last spring alone is past its limit, an arm of the last angle spring
    REQUIRE(chain.model->accept({}, chain.y) == 0);
    CHECK(chain.breaks().broke() == (asked ? 2 : 1));
    chain.lists("/events/broken/spring", {7});
    chain.lists("/events/broken_angles/angle", asked ? std::vector<std::int64_t>{6} : std::vector<std::int64_t>{});
    chain.lists("/events/broken_angles/number", asked ? std::vector<std::int64_t>{1} : std::vector<std::int64_t>{});
  }
}

TEST_CASE("one part at a time: the one farthest past its limit, whatever its kind") {
  Chain chain({{"-bs_break_strain", "0.4"}, {"-bs_break_angle_change", "0.1"}, {"-bs_break", "worst"}});
  chain.bend(2, 0.15, 7);  // excess 1.5 of angle 1, 1.25 of spring 7
  for (int k = 0; k < 2; ++k) {
    REQUIRE(chain.model->accept({}, chain.y) == 0);
    CHECK(chain.breaks().broke() == 1);
  }
  chain.lists("/events/broken_angles/number", {0});
  chain.lists("/events/broken/number", {1});
  REQUIRE(chain.model->accept({}, chain.y) == 0);
  CHECK(chain.breaks().broke() == 0);
}
