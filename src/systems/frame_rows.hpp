// Rows of a frame's fields on a rank, in the input's order.
#pragma once
#include <string>
#include <vector>
#include "systems/system.hpp"

namespace bs {

/// Collective. This rank's rows of the field at (t, y) whose group ends in `name`, "/position" or "/velocity", columns behind one another. What is
/// held or moves as given is where it is at time t.
PetscErrorCode frame_rows(System& system, double t, Vec y, const std::string& name, std::vector<double>* rows);

/// Collective. This rank's numbers of a vector in the input's order.
PetscErrorCode own_numbers(Vec vec, std::vector<double>* numbers);

}  // namespace bs
