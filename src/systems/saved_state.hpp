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
  bool whole = false;   ///< every rank has all rows, for a system on any number of ranks; else its own
  Parts state, memory;  ///< of y, and of what the system carries besides: histories, what is broken
  std::map<std::string, double> sums;
};

/// Collective. What `system` is at y.
PetscErrorCode read_state(System& system, double time, Vec y, bool whole, SavedState* out);

/// Collective. Whether it is a state of this system: it has all of its parts, of their sizes, and no others.
PetscErrorCode fits(System& system, const SavedState& from, bool* yes);

/// Collective. y, and what `system` carries besides, become what was read. What it carries and `from` has not stays what it is.
/// Error (exit 2): parts of other sizes, which are another system's.
PetscErrorCode put_state(System& system, const SavedState& from, Vec y);

/// Collective. The same of what it carries alone, without sums.
PetscErrorCode put_memory(System& system, const SavedState& from);

/// Collective. The same of parts, for arrays that go with a state.
PetscErrorCode read_parts(MPI_Comm comm, const std::vector<StatePart>& parts, bool whole, SavedState::Parts* out);
PetscErrorCode put_parts(MPI_Comm comm, const SavedState::Parts& from, bool whole, const std::vector<StatePart>& parts);

}  // namespace bs
