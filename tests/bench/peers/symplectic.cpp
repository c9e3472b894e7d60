// Symplectic Euler in a plain loop, at 0.95 of the largest stable step 2/omega_max.
#include <cmath>
#include <cstdio>
#include "cube.hpp"

using peers::Values;

/// sqrt of the largest eigenvalue of M^-1 K at the start, by power iteration on differences of forces.
static double largest_frequency(const peers::Cube& cube, int iterations) {
  constexpr double SMALL = 1e-7;
  Values q(cube.x.size()), x(cube.x.size()), f(cube.x.size()), f0(cube.x.size());
  for (std::size_t k = 0; k < q.size(); ++k) q[k] = std::sin(12.9898 * static_cast<double>(k + 1));
  forces(cube, cube.x.data(), f0.data());
  double value = 0;
  for (int it = 0; it < iterations; ++it) {
    double norm = 0, size = 0;
    for (double entry : q) norm += entry * entry, size = std::max(size, std::abs(entry));
    for (std::size_t k = 0; k < q.size(); ++k) x[k] = cube.x[k] + SMALL * q[k] / size;
    forces(cube, x.data(), f.data());
    double product = 0;
    for (std::size_t k = 0; k < q.size(); ++k) {
      const double Kq = cube.fixed[k / 3] ? 0.0 : (f0[k] - f[k]) * size / (SMALL * cube.mass);
      product += q[k] * Kq;
      f[k] = Kq;
    }
    value = product / norm;
    const double scale = 1 / std::sqrt(norm) / value;
    for (std::size_t k = 0; k < q.size(); ++k) q[k] = f[k] * scale;
  }
  return std::sqrt(value);
}

int main(int argc, char** argv) {
  const peers::Arguments given(argc, argv, {{"n", 12}, {"time", 0.05}, {"stiff", 0}, {"share", 0.95}});
  peers::Cube cube = peers::make_cube(given.whole("n"), given["stiff"] != 0);
  const double omega = largest_frequency(cube, 200);
  const double T = given["time"];
  const int steps = static_cast<int>(std::ceil(T / (given["share"] * 2 / omega)));
  const double h = T / steps, per_mass = h / cube.mass;
  Values f(cube.x.size());
  const double start = peers::now();
  for (int step = 0; step < steps; ++step) {
    // v_{n+1} = v_n + h f(x_n)/m, x_{n+1} = x_n + h v_{n+1}; forces on fixed particles are 0
    forces(cube, cube.x.data(), f.data());
    for (std::size_t k = 0; k < f.size(); ++k) {
      cube.v[k] += per_mass * f[k];
      cube.x[k] += h * cube.v[k];
    }
  }
  const double seconds = peers::now() - start;
  peers::print_json({{"seconds", seconds},
                     {"steps", steps},
                     {"h", h},
                     {"omega_max", omega},
                     {"springs", static_cast<double>(cube.i.size())},
                     {"springs_per_s", static_cast<double>(cube.i.size()) * steps / seconds}},
                    &cube.x[cube.x.size() - 3]);
}
