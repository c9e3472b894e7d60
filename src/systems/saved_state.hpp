// A state of a system in the input's order, to which it, or another system that is made of the same input, can be brought.
#pragma once
#include <map>
#include <string>
#include <vector>
#include "systems/system.hpp"

namespace bs {

struct SavedState {
  using Parts = std::map<std::string, std::vector<double>>;
  double time = 0;      ///< [s], or the load factor of an equilibrium
  bool whole = false;   ///< every rank holds all rows, for a system on any number of ranks; else each holds its own rows
  Parts state, memory;  ///< parts of y, and of what the system carries beside it: histories, broken parts
  std::map<std::string, double> sums;
};

/// Collective. Reads the state of `system` at y into `out`.
PetscErrorCode read_state(System& system, double time, Vec y, bool whole, SavedState* out);

/// Collective. Whether `from` is a state of this system: it has all of the system's parts in their sizes, and no others.
PetscErrorCode fits(System& system, const SavedState& from, bool* yes);

/// Collective. Sets y, and what `system` carries beside it, to the saved state. What `from` has no part for stays as it is.
/// Error (exit 2): parts have other sizes, since they are of another system.
PetscErrorCode put_state(System& system, const SavedState& from, Vec y);

/// Collective. As put_state(), but only for what the system carries beside y, without the sums.
PetscErrorCode put_memory(System& system, const SavedState& from);

/// Collective. The same for single parts, such as arrays that are kept with a state.
PetscErrorCode read_parts(MPI_Comm comm, const std::vector<StatePart>& parts, bool whole, SavedState::Parts* out);
PetscErrorCode put_parts(MPI_Comm comm, const SavedState::Parts& from, bool whole, const std::vector<StatePart>& parts);

}  // namespace bs
