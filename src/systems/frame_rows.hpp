// Rows of a frame's fields on a rank, in the input's order; positions and velocities of a state as tables.
#pragma once
#include <string>
#include <vector>
#include "base/vec_array.hpp"
#include "systems/layout.hpp"
#include "systems/system.hpp"

namespace bs {

/// Collective. This rank's rows of the field at (t, y) whose group ends in `name`, "/position" or "/velocity", columns behind one another. What is
/// held or moves as given is where it is at time t.
PetscErrorCode frame_rows(System& system, double t, Vec y, const std::string& name, std::vector<double>* rows);

/// Collective. This rank's numbers of a vector in the input's order.
PetscErrorCode own_numbers(Vec vec, std::vector<double>* numbers);

/// The positions or the velocities of a state; as a table (particles, dim) of doubles they have the state's order.
enum class Part { position, velocity };

/// Those of `y` become `scale` times `table`.
inline void set_part(Vec y, Part part, const double* table, double scale = 1) {
  const WriteArray a(y);
  layout_of(y).for_each([&](PetscInt x, PetscInt v) { a[part == Part::position ? x : v] = scale * *table++; });
}

/// `table` becomes those of `y`.
inline void get_part(Vec y, Part part, double* table) {
  const ReadArray a(y);
  layout_of(y).for_each([&](PetscInt x, PetscInt v) { *table++ = a[part == Part::position ? x : v]; });
}

}  // namespace bs
