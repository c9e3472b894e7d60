// Checkpoints in memory, for a program on the library that goes back to a moment.
#pragma once
#include <map>
#include <string>
#include <vector>
#include "checkpoint/checkpoint.hpp"
#include "systems/saved_state.hpp"

namespace bs {

/// Of a run on as many ranks, without what its system carries besides the state: whoever restores that system puts that back
/// (systems/saved_state.hpp).
class KeptCheckpoint : public Checkpoint {
 public:
  /// Collective. `states`: the state, "/state", and those that its method remembers.
  PetscErrorCode keep(Model& model, const Facts& run, const std::vector<NamedState>& states);
  bool has(const std::string& group) const override { return states_.count(group) > 0; }
  PetscErrorCode read_memory(Model&) const override { return 0; }

 private:
  PetscErrorCode read_parts(MPI_Comm comm, const std::string& group, const std::vector<StatePart>& parts) const override;
  std::map<std::string, SavedState::Parts> states_;
};

}  // namespace bs
