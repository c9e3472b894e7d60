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

PetscErrorCode KeptCheckpoint::read(Model& model, const std::string& group, Vec y) const {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(model.gather_state(y, &parts));  // for their vectors
  PetscCall(put_parts(model.comm(), states_.at(group), false, parts));
  PetscCall(model.scatter_state(y));
  PetscFunctionReturn(0);
}

}  // namespace bs
