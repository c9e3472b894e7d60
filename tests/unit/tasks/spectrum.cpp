// The fastest oscillation and damping rate of a chain, of which both are known in closed form, and what explicit steps they allow.
#include "tasks/spectrum.hpp"
#include <cmath>
#include "base/vec_array.hpp"
#include "options.hpp"
#include "systems/model.hpp"

using namespace bs;

namespace {

constexpr int N = 40;
constexpr double MASS = 0.5, STIFFNESS = 300, DAMPING = 0.8;

OptionTexts chain(const std::string& damping) {
  return {{"-bs_lattice_type", "chain"},
          {"-bs_lattice_size", std::to_string(N)},
          {"-bs_lattice_dim", "1"},
          {"-bs_lattice_fixed", "xmin,xmax"},
          {"-bs_lattice_particle_mass", "0.5"},
          {"-bs_lattice_stiffness", "300"},
          {"-bs_lattice_damping", damping},
          {"-bs_lattice_spacing", "1"}};
}

/// Of N - 2 free particles between two fixed ones: 4 sin^2(pi k/(2 (N - 1))), the largest.
double largest() { return 4 * std::pow(std::sin(M_PI * (N - 2) / (2.0 * (N - 1))), 2); }

}  // namespace

TEST_CASE("the fastest oscillation of a chain is enclosed, and its damping rate found, by few evaluations of the forces") {
  for (const bool damped : {false, true}) {
    const std::unique_ptr<Model> model = model_of(chain(damped ? "0.8" : "0"));
    const double omega = std::sqrt(STIFFNESS / MASS * largest());
    Spectrum found;
    REQUIRE(estimate_spectrum(*model->mechanics(), 0, model->initial_state(), &found) == 0);
    INFO("damped: " << damped << ", Ritz value " << found.omega_ritz << ", bound " << found.omega_max << ", exact " << omega);
    CHECK(found.omega_ritz <= omega * (1 + 1e-4));
    CHECK(found.omega_ritz >= 0.97 * omega);
    CHECK(found.omega_max >= omega * (1 - 1e-4));
    CHECK(found.omega_max <= 1.03 * omega);
    CHECK(found.motion == 0);  // at rest
    CHECK(found.evaluations <= 15);
    CHECK(found.seconds >= 0);
    const double rate = DAMPING / MASS * largest();
    if (damped) CHECK(found.damping == Approx(rate).epsilon(0.15));
    else CHECK(found.damping == 0);
  }
}

TEST_CASE("the rate of the present motion is that of a mode that swings alone") {
  const std::unique_ptr<Model> model = model_of(chain("0"));
  const Layout& at = model->mechanics()->layout();
  Spectrum found;
  {
    const WriteArray a(model->initial_state());
    for (PetscInt i = 0; i < at.particles; ++i) a[at.v(i)] = std::sin(M_PI * 3 * a[at.x(i)] / (N - 1));  // spacing 1
  }
  REQUIRE(estimate_spectrum(*model->mechanics(), 0, model->initial_state(), &found) == 0);
  const double omega = 2 * std::sqrt(STIFFNESS / MASS) * std::sin(M_PI * 3 / (2.0 * (N - 1)));
  CHECK(found.motion == Approx(omega).epsilon(1e-3));
}
