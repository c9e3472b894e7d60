// What springs carry against the list of all springs.
#include "systems/particles/spring_fields.hpp"
#include <catch2/catch.hpp>
#include <cmath>
#include "base/vec_array.hpp"
#include "held_network.hpp"
#include "small_network.hpp"

using namespace bs;

namespace {

const OptionTexts net = {
    {"-bs_lattice_type", "square"}, {"-bs_lattice_size", "6,5"}, {"-bs_lattice_rest_length_factor", "0.9"}, {"-bs_lattice_perturbation", "0.2"}};

}  // namespace

TEST_CASE("strains and tensions of springs are those of the list of all springs", "[spring_fields]") {
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
  SpringFields springs;
  std::vector<Field> found;
  ParticleLaws laws;
  RowPattern pattern;
  const Terms terms(at.net, laws, at.constraints.anchors(), pattern);
  REQUIRE(state.create(at.net, at.y) == 0);
  REQUIRE(state.gather(0, at.y) == 0);
  {
    const Given given(OptionTexts{{"-bs_output_springs", "true"}});
    REQUIRE(springs.create(at.net, at.lattice) == 0);
  }
  REQUIRE(springs.fields(terms, state, &found) == 0);
  REQUIRE(found.size() == 2);
  CHECK(found[0].group == "/observables/springs/tension");
  CHECK(found[1].group == "/observables/springs/strain");
  GeneratorSpec spec = lattice(LatticeType::square, {6, 5}, 2);
  spec.rest_length_factor = 0.9;
  spec.perturbation = 0.2;
  const Lattice whole = generate(spec, 0, 1);
  const ReadArray tensions(found[0].vec), strains(found[1].vec);
  for (std::int64_t k = 0; k < at.lattice.springs.count; ++k) {
    const std::size_t s = static_cast<std::size_t>(at.lattice.springs.first + k);
    const double *p = whole.position.data() + 2 * whole.pairs[2 * s], *q = whole.position.data() + 2 * whole.pairs[2 * s + 1];
    const double dx = q[0] - p[0], dy = q[1] - p[1], length = std::hypot(1.1 * dx + 0.3 * dy, 0.8 * dy);
    const double rest = at.lattice.rest_length[static_cast<std::size_t>(k)];
    CHECK(strains[k] == Approx(length / rest - 1).epsilon(1e-12).margin(1e-13));
    CHECK(tensions[k] == Approx(at.lattice.stiffness[static_cast<std::size_t>(k)] * (length - rest)).epsilon(1e-12).margin(1e-10));
  }
}
