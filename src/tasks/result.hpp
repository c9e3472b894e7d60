// What a task finds, for a program that asks for numbers and not for files.
#pragma once
#include <cstdint>
#include <vector>

namespace bs {

/// Filled by the task that finds it; the same on every rank, particles in the order of the input.
struct Result {
  double load_factor = 0;             ///< statics, moduli: of the last equilibrium
  std::vector<double> position;       ///< statics, moduli: of the last equilibrium, (N, d) [m]
  std::vector<double> stiffness;      ///< moduli: (q, q), row by row, by the components of tasks/moduli.hpp [N/m^(d-1)]
  std::vector<double> omega_squared;  ///< modes: ascending [1/s^2]
  std::vector<double> residual;       ///< modes: bounds of the errors of omega_squared [1/s^2]
  std::int64_t zero_modes = -1;       ///< modes, moduli: motions without stiffness; -1: not counted
};

}  // namespace bs
