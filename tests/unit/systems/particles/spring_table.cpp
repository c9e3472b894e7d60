// Numbers of springs between links and rows of the input; strains against those of the list of all springs.
#include "systems/particles/spring_table.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include "held_network.hpp"
#include "small_network.hpp"

using namespace bs;

namespace {

const OptionTexts net = {
    {"-bs_lattice_type", "square"}, {"-bs_lattice_size", "6,5"}, {"-bs_lattice_rest_length_factor", "0.9"}, {"-bs_lattice_perturbation", "0.2"}};

double number_of(std::int64_t spring) { return std::cos(static_cast<double>(spring)); }

}  // namespace

TEST_CASE("numbers of springs come into the order of the input, and from there to both ends", "[spring_table]") {
  for (const char* partition : {"graph", "rows"}) {
    OptionTexts texts = net;
    texts["-bs_partition"] = partition;
    const HeldNetwork at(texts);
    SpringTable table;
    CHECK_FALSE(table.created());
    REQUIRE(table.create(at.net, at.lattice.springs) == 0);
    VecHandle rows;
    const auto value = [&](PetscInt, PetscInt e) { return number_of(at.net.links.spring[static_cast<std::size_t>(e)]); };
    REQUIRE(table.gather(value, &rows) == 0);
    PetscInt count = 0;
    const PetscScalar* found = nullptr;
    REQUIRE(VecGetLocalSize(rows, &count) == 0);
    REQUIRE(count == at.lattice.springs.count);
    REQUIRE(VecGetArrayRead(rows, &found) == 0);
    for (PetscInt k = 0; k < count; ++k) REQUIRE(found[k] == number_of(at.lattice.springs.first + k));
    REQUIRE(VecRestoreArrayRead(rows, &found) == 0);
    REQUIRE(VecScale(rows, 2) == 0);
    std::vector<double> put(at.net.links.spring.size(), NAN);
    for (int turn = 0; turn < 2; ++turn) {  // the second time by the scatter of the first
      REQUIRE(table.spread(rows, [&](PetscInt e, double x) { put[static_cast<std::size_t>(e)] = x; }) == 0);
      for (std::size_t e = 0; e < put.size(); ++e) REQUIRE(put[e] == 2 * number_of(at.net.links.spring[e]));
    }
  }
}

TEST_CASE("strains of springs are those of the list of all springs", "[spring_table]") {
  HeldNetwork at(net);
  // x -> (I + G) x with G = [0.1 0.3; 0 -0.2], from the places of the perturbed lattice
  PetscScalar* a = nullptr;
  REQUIRE(VecGetArray(at.y, &a) == 0);
  for (PetscInt i = 0; i < at.net.n; ++i) {
    const double* x = at.net.held.data() + 2 * i;
    a[4 * i] = 1.1 * x[0] + 0.3 * x[1];
    a[4 * i + 1] = 0.8 * x[1];
  }
  REQUIRE(VecRestoreArray(at.y, &a) == 0);
  LocalState state;
  SpringStrain strain;
  Vec found;
  CHECK_FALSE(static_cast<bool>(strain));
  REQUIRE(state.create(at.net, at.y) == 0);
  REQUIRE(state.gather(0, at.y) == 0);
  REQUIRE(strain.create(at.net, at.lattice.springs) == 0);
  REQUIRE(strain.compute(state, &found) == 0);
  GeneratorSpec spec = lattice(LatticeType::square, {6, 5}, 2);
  spec.rest_length_factor = 0.9;
  spec.perturbation = 0.2;
  const Lattice whole = generate(spec, 0, 1);
  const PetscScalar* values = nullptr;
  REQUIRE(VecGetArrayRead(found, &values) == 0);
  for (std::int64_t k = 0; k < at.lattice.springs.count; ++k) {
    const std::size_t s = static_cast<std::size_t>(at.lattice.springs.first + k);
    const double *p = whole.position.data() + 2 * whole.pairs[2 * s], *q = whole.position.data() + 2 * whole.pairs[2 * s + 1];
    const double dx = q[0] - p[0], dy = q[1] - p[1], length = std::hypot(1.1 * dx + 0.3 * dy, 0.8 * dy);
    const double rest = at.lattice.rest_length[static_cast<std::size_t>(k)];
    CHECK(values[k] == Approx(length / rest - 1).epsilon(1e-12).margin(1e-13));
  }
  REQUIRE(VecRestoreArrayRead(found, &values) == 0);
}
