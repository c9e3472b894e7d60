// A state of a system, whole on every rank, to which another system that is made of the same input can be brought.
#pragma once
#include <map>
#include <string>
#include <vector>
#include "systems/system.hpp"

namespace bs {

struct Standing {
  double time = 0;                                 ///< [s], or the load factor of an equilibrium
  std::vector<std::vector<double>> state, memory;  ///< parts of y, and of what the system carries besides; empty state: there is none
  std::map<std::string, double> sums;
};

/// Collective. What `system` is at y.
PetscErrorCode read_standing(System& system, double time, Vec y, Standing* out);

/// Collective. `system` and y become what was read. Error (exit 2): parts of other sizes, which are another system's.
PetscErrorCode stand_at(System& system, const Standing& from, Vec y);

}  // namespace bs
