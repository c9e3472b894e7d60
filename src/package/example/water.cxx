// A molecule of water with a law of its own (morse_bond.hpp): its shape under an electric field's force, and its vibrations.
// Units: angstrom, dalton, kJ/mol; times are in 0.1 ps.
#include <cstdio>
#include <memory>
#include <vector>

#include "morse_bond.hpp"

static bs::Error run() {
  bs::LatticeArrays water;
  water.dim = 3;
  water.position = {0, 0, 0, 0.96, 0.1, 0, -0.3, 0.9, 0.2};
  water.mass = {15.999, 1.008, 1.008};
  water.fixed = {1, 0, 0};
  water.interactions = {{"angles", {1, 0, 2}, {383, 1.8242}, {}}, {"morse_bonds", {0, 1, 0, 2}, {432.6, 2.2855, 0.9419, 432.6, 2.2855, 0.9419}, {}}};
  water.groups = {{"hydrogen", {0, 1, 1}}};
  const bs::Settings field = {{"-bs_force_hydrogen", "30,-20,5"}, {"-bs_modes_about", "equilibrium"}};

  std::unique_ptr<bs::Session> session;
  bs::Error error = bs::Session::create(MPI_COMM_WORLD, water, field, &session, bs::Session::Make::when_needed);
  bs::Result found;
  if (!error) error = session->solve_statics(&found, {{"-snes_rtol", "1e-12"}});
  if (error) return error;
  for (const double x : found.frame.table("position")->value) std::printf("%.17g ", x);
  error = session->modes(6, &found);
  std::printf("\n");
  for (const double w2 : found.omega_squared) std::printf("%.17g ", w2);
  std::printf("\n");
  return error;
}

int main() {
  bs::register_interaction_law<MorseBond>();
  const bs::Library library;  // starts MPI and PETSc
  if (!library.started()) return 1;
  const bs::Error error = run();
  if (error) std::fprintf(stderr, "%s\n", error.text.c_str());
  return static_cast<int>(error ? error.exit : bs::Exit::ok);
}
