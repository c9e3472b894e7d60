// Where a program on the library leaves a function that computes forces.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

namespace bs {

/// In the context of the communicator: asked for by every system of particles that is made on it. All functions are of particles at (x, v), (rows, d)
/// each, and of the time t [s], in an equilibrium the load factor; `row`: all of this rank's rows of the input, ascending, those of particles
/// that are fixed included. They must depend on nothing else. Not collective: ranks ask at different times.
struct ForceCallback {
  using Rows = std::vector<std::int64_t>;
  /// Adds the forces to f, (rows, d) [N]. Empty: there are none.
  std::function<void(double t, const Rows& row, const double* x, const double* v, double* f)> force;
  /// Adds what the force on each particle changes by with its own place and velocity, df/dx to K [N/m] and df/dv to D [N s/m], (rows, d, d). Empty:
  /// the tangent has nothing of the forces, and Newton's method takes them as they were at the last iterate.
  std::function<void(double t, const Rows& row, const double* x, const double* v, double* K, double* D)> tangent;
  /// Adds energies to E, (rows) [J], where each particle's force is minus the gradient of its energy by its place. Empty: there is no potential.
  std::function<void(double t, const Rows& row, const double* x, double* E)> energy;
};

}  // namespace bs
