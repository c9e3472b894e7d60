// Rows of a frame's fields on a rank, in the input's order; positions and velocities of a state as tables.
#pragma once
#include <string>
#include <vector>
#include "base/vec_array.hpp"
#include "systems/layout.hpp"
#include "systems/saved_state.hpp"
#include "systems/system.hpp"

namespace bs {

/// Collective. This rank's rows of the field at (t, y) whose group ends in `name`, "/position" or "/velocity", columns behind one another. What is
/// held or moves as given is where it is at time t.
PetscErrorCode frame_rows(System& system, double t, Vec y, const std::string& name, std::vector<double>* rows);

/// Collective. This rank's rows, in the input's order, of numbers of the owned particles, (n, d) in the order of the state y.
PetscErrorCode rows_of_particles(System& system, Vec y, const double* numbers, std::vector<double>* rows);

/// A field of a frame, whole: (rows, columns) in the input's order.
struct FrameTable {
  std::string name;  ///< the last part of its path in a trajectory: position, velocity, tension
  int columns = 1;
  std::vector<double> value;
};

/// What a frame of a trajectory holds, in memory.
struct FrameData {
  double time = 0;  ///< [s], or the load factor's place in a static run
  std::vector<Observable> observables;
  std::vector<FrameTable> tables;
  std::vector<FrameTable> breaks;  ///< what broke so far, by the columns of /events/broken; empty where nothing did
  SavedState state;                ///< of equilibria, whole
  std::vector<double> reaction;    ///< of equilibria: (N, d) forces that supports and motions exert on what is held, 0 elsewhere [N]
  /// Null: there is none of that name.
  const Observable* observable(const std::string& name) const;
  const FrameTable* table(const std::string& name) const;
};

/// Collective. Tables of all fields at (t, y), the same on every rank.
PetscErrorCode read_tables(System& system, double t, Vec y, std::vector<FrameTable>* out);

/// Collective. The list of what broke, the same on every rank, whole numbers as doubles.
PetscErrorCode read_breaks(System& system, std::vector<FrameTable>* out);

/// Collective. This rank's numbers of a vector in the input's order.
PetscErrorCode own_numbers(Vec vec, std::vector<double>* numbers);
/// Collective. Sums of (row, part) of all ranks by rows in the input's order, of which `count` are this rank's: its own.
PetscErrorCode sum_by_rows(MPI_Comm comm, std::int64_t count, const std::vector<std::pair<std::int64_t, double>>& parts, std::vector<double>* own);

/// The positions or the velocities of a state; as a table (particles, dim) of doubles they have the state's order.
enum class StateHalf { position, velocity };

/// Those of `y` become `scale` times `table`.
inline void set_half(Vec y, StateHalf half, const double* table, double scale = 1) {
  const WriteArray a(y);
  layout_of(y).for_each([&](PetscInt x, PetscInt v) { a[half == StateHalf::position ? x : v] = scale * *table++; });
}

/// `table` becomes those of `y`.
inline void get_half(Vec y, StateHalf half, double* table) {
  const ReadArray a(y);
  layout_of(y).for_each([&](PetscInt x, PetscInt v) { *table++ = a[half == StateHalf::position ? x : v]; });
}

}  // namespace bs
