#include "checkpoint/kept.hpp"

namespace bs {

PetscErrorCode KeptCheckpoint::keep(Model& model, const Facts& run, const std::vector<NamedState>& states) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  name_ = "the saved state";
  run_ = run;
  states_.clear();
  for (const NamedState& one : states) {
    PetscCall(model.gather_state(one.vec, &parts));
    PetscCall(bs::read_parts(model.comm(), parts, false, &states_[one.group]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode KeptCheckpoint::read_parts(MPI_Comm comm, const std::string& group, const std::vector<StatePart>& parts) const {
  PetscFunctionBegin;
  PetscCall(put_parts(comm, states_.at(group), false, parts));
  PetscFunctionReturn(0);
}

}  // namespace bs
