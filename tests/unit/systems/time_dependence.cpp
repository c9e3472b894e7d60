// Forces that are kept from one evaluation to the next do not outlive their time.
#include <map>
#include "laws_common.hpp"
#include "physics/body/registry.hpp"
#include "systems/create.hpp"
#include "systems/mechanics.hpp"

using namespace bs;
using namespace law_tests;

namespace {

using Options = std::map<std::string, std::string>;

std::unique_ptr<Model> model_of(const Options& options) {
  REQUIRE(PetscOptionsSetValue(nullptr, "-bs_partition", "rows") == 0);  // two models then number particles alike
  for (const auto& [name, value] : options) REQUIRE(PetscOptionsSetValue(nullptr, name.c_str(), value.c_str()) == 0);
  std::unique_ptr<Model> model;
  REQUIRE(create_model(PETSC_COMM_WORLD, &model) == 0);
  REQUIRE(PetscOptionsClearValue(nullptr, "-bs_partition") == 0);
  for (const auto& [name, value] : options) REQUIRE(PetscOptionsClearValue(nullptr, name.c_str()) == 0);
  return model;
}

std::vector<double> forces(Model& model, double t, Vec y) {
  const double* f = nullptr;
  const Layout& at = model.mechanics()->layout();
  REQUIRE(model.mechanics()->force(t, y, &f) == 0);
  return {f, f + at.particles * at.dim};
}

template <class Law>
void looks_at_the_clock(const Law& law) {
  Dice dice(3);
  for (int n = 0; n < 20; ++n) {
    State<2> state(dice, 2);
    Point<2> now = state.point(), later = now;
    later.t += 1;
    double f[2] = {0, 0}, g[2] = {0, 0};
    (void)law.template force<2>(now, f);
    (void)law.template force<2>(later, g);
    INFO(Law::title);
    CHECK((varies_in_time<Law>::value || (f[0] == g[0] && f[1] == g[1])));
  }
}

}  // namespace

TEST_CASE("forces on the same state at another time are those of that time") {
  const Options net = {
      {"-bs_lattice_type", "square"}, {"-bs_lattice_size", "12,12"}, {"-bs_lattice_perturbation", "0.1"}, {"-bs_group_edge", "xmax"}};
  const Options box = {
      {"-bs_lattice_type", "square"}, {"-bs_lattice_size", "12,12"}, {"-bs_lattice_perturbation", "0.1"}, {"-bs_lattice_periodic", "xy"}};
  struct Term {
    const char* name;
    Options base, more;
    bool depends;
  };
  const Term terms[] = {
      {"springs and gravity", net, {{"-bs_gravity", "0,-1"}}, false},
      {"anchors that rest", net, {{"-bs_anchor_group", "edge"}, {"-bs_anchor_stiffness", "10"}}, false},
      {"anchors that move",
       net,
       {{"-bs_anchor_particles", "13,66,100"}, {"-bs_anchor_stiffness", "10"}, {"-bs_anchor_motion", "velocity"}, {"-bs_anchor_velocity", "1,0"}},
       true},
      {"anchors that swing",
       net,
       {{"-bs_anchor_particles", "66"},
        {"-bs_anchor_stiffness", "10"},
        {"-bs_anchor_motion", "sinusoid"},
        {"-bs_anchor_amplitude", "0.1,0.2"},
        {"-bs_anchor_frequency", "0.3"}},
       true},
      {"a driven group", net, {{"-bs_motion_edge", "velocity:0.1,0"}}, true},
      {"a driven component", net, {{"-bs_motion_edge", "x=expression:sin(t),y=free"}}, true},
      {"a strained box", box, {{"-bs_box_strain", "xy=velocity:0.1"}}, true},
      {"a box of a constant rate", box, {{"-bs_box_rate", "xx=0.1"}}, true},
  };
  for (const Term& term : terms) {
    Options options = term.base;
    options.insert(term.more.begin(), term.more.end());
    const auto kept = model_of(options), fresh = model_of(options);
    INFO(term.name);
    CHECK(kept->time_dependent() == term.depends);
    const std::vector<double> first = forces(*kept, 0, kept->initial_state());
    const std::vector<double> again = forces(*kept, 0, kept->initial_state());
    const std::vector<double> later = forces(*kept, 1.5, kept->initial_state());
    const std::vector<double> asked = forces(*fresh, 1.5, fresh->initial_state());
    CHECK(first == again);
    REQUIRE(later.size() == asked.size());
    double apart = 0, size = 0;
    for (std::size_t k = 0; k < later.size(); ++k) apart = std::max(apart, std::abs(later[k] - asked[k])), size = std::max(size, std::abs(asked[k]));
    CHECK(apart <= 1e-13 * size);
    int differs = first != later;
    MPI_Allreduce(MPI_IN_PLACE, &differs, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
    CHECK((differs != 0) == term.depends);
    CHECK(forces(*kept, 0, kept->initial_state()) == first);
  }
}

TEST_CASE("laws that depend on the time say so") {
  ParticleLaws laws;
  for (double& g : std::get<UniformGravity>(laws).g) g = 1;
  std::get<Several<CentralGravity>>(laws).all.front().M0 = 1e12;
  std::get<MassDrag>(laws).c = std::get<StokesDrag>(laws).D = 1;
  std::get<SphereDrag>(laws).rho = std::get<SphereDrag>(laws).mu = 1;
  ShapeDrag& shape = std::get<ShapeDrag>(laws);
  shape.drag_coefficient = shape.rho = shape.area = 1;
  std::get<XspAttraction>(laws).value = std::get<XspWalls>(laws).value = 1;
  for_each_law(laws, [](const auto& law) { looks_at_the_clock(law); });
}
