// Where a program on the library leaves a function that computes forces.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

namespace bs {

/// In the context of the communicator: asked for by every system of particles that is made on it. Adds to f (rows, d) the forces [N] on particles at
/// (x, v), (rows, d) each, of time t [s], in an equilibrium the load factor; `row`: rows of the input, some of this rank's, ascending where that rank
/// is alone. Empty: there are none. Not collective: ranks ask for different particles at different times.
struct ForceCallback {
  std::function<void(double t, const std::vector<std::int64_t>& row, const double* x, const double* v, double* f)> force;
};

}  // namespace bs
