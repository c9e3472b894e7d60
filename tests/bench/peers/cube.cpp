#include "cube.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include "lattice/generator.hpp"

namespace peers {

Cube make_cube(int n, bool stiff) {
  bs::GeneratorSpec spec;
  spec.type = bs::LatticeType::cubic;
  spec.size = {n, n, n};
  spec.neighbors = 18;
  spec.spacing = {1.0 / n};
  spec.total_mass = 1000;
  spec.fixed = {"zmin"};
  spec.stiffness = {250};
  spec.velocity_gradient = {0, 0, 1, 0, 0, 0, 0, 0, 0};
  if (stiff) {
    spec.stiff_fraction = 0.01;
    spec.stiff_factor = 1e4;
  }
  const std::string wrong = bs::check(spec);
  if (!wrong.empty()) {
    std::fprintf(stderr, "%s\n", wrong.c_str());
    std::exit(2);
  }
  bs::Lattice lattice = bs::generate(spec, 0, 1);
  Cube cube;
  cube.n = n;
  cube.particles = lattice.mass.size();
  cube.mass = lattice.mass[0];
  for (std::size_t s = 0; s < lattice.stiffness.size(); ++s) {
    cube.i.push_back(static_cast<int>(lattice.pairs[2 * s]));
    cube.j.push_back(static_cast<int>(lattice.pairs[2 * s + 1]));
  }
  cube.K = std::move(lattice.stiffness);
  cube.L = std::move(lattice.rest_length);
  cube.fixed = std::move(lattice.fixed);
  cube.x = std::move(lattice.position);
  cube.v = std::move(lattice.velocity);
  return cube;
}

void forces(const Cube& cube, const double* x, double* f) {
  for (std::size_t p = 0; p < cube.particles; ++p) {
    f[3 * p] = f[3 * p + 1] = 0;
    f[3 * p + 2] = cube.mass * GRAVITY;
  }
  for (std::size_t s = 0; s < cube.i.size(); ++s) {
    const double* a = x + 3 * cube.i[s];
    const double* b = x + 3 * cube.j[s];
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    const double l = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    const double pull = cube.K[s] * (1 / cube.L[s] - 1 / l);
    for (int c = 0; c < 3; ++c) {
      f[3 * cube.i[s] + c] -= pull * d[c];
      f[3 * cube.j[s] + c] += pull * d[c];
    }
  }
  for (std::size_t p = 0; p < cube.particles; ++p)
    if (cube.fixed[p]) f[3 * p] = f[3 * p + 1] = f[3 * p + 2] = 0;
}

Arguments::Arguments(int argc, char** argv, std::map<std::string, double> defaults) : values_(std::move(defaults)) {
  for (int k = 1; k < argc; k += 2) {
    const std::string name = std::string(argv[k]).substr(0, 2) == "--" ? argv[k] + 2 : argv[k];
    if (!values_.count(name) || k + 1 == argc) {
      std::fprintf(stderr, "%s: unknown, or without a number; there are", argv[k]);
      for (const auto& [known, value] : values_) std::fprintf(stderr, " --%s %g", known.c_str(), value);
      std::fprintf(stderr, "\n");
      std::exit(2);
    }
    values_[name] = std::atof(argv[k + 1]);
  }
}

double median(Values values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

void print_json(const std::vector<std::pair<std::string, double>>& figures, const double* last) {
  std::printf("{");
  for (const auto& [name, value] : figures) std::printf("\"%s\": %.17g, ", name.c_str(), value);
  std::printf("\"last\": [%.17g, %.17g, %.17g]}\n", last[0], last[1], last[2]);
}

}  // namespace peers
