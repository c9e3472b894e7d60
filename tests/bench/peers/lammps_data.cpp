// Writes the lattice as a LAMMPS data file on stdout: LAMMPS's harmonic bond is E = K (r - r0)^2, so that K = k/2 with
// k = (strain stiffness)/(rest length).
#include <cstdio>
#include <map>
#include "cube.hpp"

int main(int argc, char** argv) {
  const peers::Arguments given(argc, argv, {{"n", 12}, {"stiff", 0}});
  const peers::Cube cube = peers::make_cube(given.whole("n"), given["stiff"] != 0);
  std::map<std::pair<double, double>, int> types;
  for (std::size_t s = 0; s < cube.i.size(); ++s) types.emplace(std::make_pair(0.5 * cube.K[s] / cube.L[s], cube.L[s]), 0);
  int count = 0;
  for (auto& [parameters, type] : types) type = ++count;
  std::printf("benchmark lattice\n\n%zu atoms\n%zu bonds\n2 atom types\n%d bond types\n\n", cube.particles, cube.i.size(), count);
  for (const char* axis : {"x", "y", "z"}) std::printf("-1 2 %slo %shi\n", axis, axis);
  std::printf("\nMasses\n\n1 %.17g\n2 %.17g\n\nBond Coeffs\n\n", cube.mass, cube.mass);
  for (const auto& [parameters, type] : types) std::printf("%d %.17g %.17g\n", type, parameters.first, parameters.second);
  std::printf("\nAtoms # bond\n\n");
  for (std::size_t p = 0; p < cube.particles; ++p)
    std::printf("%zu 1 %d %.17g %.17g %.17g\n", p + 1, cube.fixed[p] ? 2 : 1, cube.x[3 * p], cube.x[3 * p + 1], cube.x[3 * p + 2]);
  std::printf("\nVelocities\n\n");
  for (std::size_t p = 0; p < cube.particles; ++p) std::printf("%zu %.17g %.17g %.17g\n", p + 1, cube.v[3 * p], cube.v[3 * p + 1], cube.v[3 * p + 2]);
  std::printf("\nBonds\n\n");
  for (std::size_t s = 0; s < cube.i.size(); ++s)
    std::printf("%zu %d %d %d\n", s + 1, types[{0.5 * cube.K[s] / cube.L[s], cube.L[s]}], cube.i[s] + 1, cube.j[s] + 1);
}
