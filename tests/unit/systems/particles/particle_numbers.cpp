// Numbers that are given anew to a model: what it has computed with others is forgotten.
#include <catch2/catch.hpp>
#include "systems/particles/particle_model.hpp"

#include <algorithm>
#include <vector>

#include "base/collective.hpp"
#include "options.hpp"
#include "systems/create.hpp"
#include "systems/model.hpp"

using namespace bs;

TEST_CASE("forces and energies at a state that was looked at before are those of the numbers of now") {
  const Given given({{"-bs_lattice_type", "triangular"},
                     {"-bs_lattice_size", "5,5"},
                     {"-bs_lattice_dim", "2"},
                     {"-bs_lattice_perturbation", "0.1"},
                     {"-bs_lattice_rest_length_factor", "0.9"},
                     {"-bs_lattice_stiffness", "50"}});
  std::unique_ptr<Model> model;
  REQUIRE(create_model(PETSC_COMM_WORLD, &model) == 0);
  Mechanics& mechanics = *model->mechanics();
  const Vec y = model->initial_state();
  const std::size_t count = static_cast<std::size_t>(mechanics.layout().particles) * 2;
  const double* f = nullptr;
  const auto elastic = [&] {
    std::vector<Observable> all;
    REQUIRE(model->observe(0, y, &all) == 0);
    return std::find_if(all.begin(), all.end(), [](const Observable& one) { return one.name == "elastic_energy"; })->value[0];
  };
  REQUIRE(mechanics.force(0, y, &f) == 0);
  const std::vector<double> before(f, f + count);
  const double energy = elastic();
  REQUIRE(energy > 0);
  REQUIRE(mechanics.set_numbers("stiffness", std::vector<double>(56, 150)) == 0);  // three times as stiff
  REQUIRE(mechanics.force(0, y, &f) == 0);
  for (std::size_t k = 0; k < count; ++k) REQUIRE(f[k] == Approx(3 * before[k]).epsilon(1e-12).margin(1e-12));
  REQUIRE(elastic() == Approx(3 * energy).epsilon(1e-12));
}
