#include "systems/saved_state.hpp"
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "systems/frame_rows.hpp"

namespace bs {

PetscErrorCode read_parts(MPI_Comm comm, const std::vector<StatePart>& parts, bool whole, SavedState::Parts* out) {
  PetscFunctionBegin;
  out->clear();
  for (const StatePart& part : parts) {
    std::vector<double>& rows = (*out)[part.name];
    PetscCall(own_numbers(part.vec, &rows));
    if (whole) PetscCall(gather_all(comm, rows, &rows));
  }
  PetscFunctionReturn(0);
}

/// Whether those of them that `from` has are of their sizes here; `present`: how many these are.
static PetscErrorCode same_sizes(const SavedState::Parts& from, bool whole, const std::vector<StatePart>& parts, bool* same, std::size_t* present) {
  PetscFunctionBegin;
  *same = true;
  *present = 0;
  for (const StatePart& part : parts) {
    PetscInt size = 0;
    PetscCall(whole ? VecGetSize(part.vec, &size) : VecGetLocalSize(part.vec, &size));
    const auto at = from.find(part.name);
    if (at == from.end()) continue;
    ++*present;
    *same = *same && at->second.size() == static_cast<std::size_t>(size);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode put_parts(MPI_Comm comm, const SavedState::Parts& from, bool whole, const std::vector<StatePart>& parts) {
  bool same = false, other = false;
  std::size_t present = 0;
  PetscFunctionBegin;
  PetscCall(same_sizes(from, whole, parts, &same, &present));
  PetscCall(on_some_rank(comm, !same, &other));
  if (other) PetscCall(fail(comm, Exit::input, "the state is one of another lattice: give one that was saved of the same lattice"));
  for (const StatePart& part : parts) {
    PetscInt first = 0, end = 0;
    const auto at = from.find(part.name);
    if (at == from.end()) continue;
    PetscCall(VecGetOwnershipRange(part.vec, &first, &end));
    std::copy_n(at->second.begin() + (whole ? first : 0), end - first, WriteArray(part.vec).data());
  }
  PetscFunctionReturn(0);
}

PetscErrorCode read_state(System& system, double time, Vec y, bool whole, SavedState* out) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  out->time = time;
  out->whole = whole;
  PetscCall(system.gather_state(y, &parts));
  PetscCall(read_parts(system.comm(), parts, whole, &out->state));
  PetscCall(system.gather_memory(&parts));
  PetscCall(read_parts(system.comm(), parts, whole, &out->memory));
  out->sums.clear();
  system.save_sums(&out->sums);
  PetscFunctionReturn(0);
}

PetscErrorCode fits(System& system, const SavedState& from, bool* yes) {
  std::vector<StatePart> parts;
  std::size_t present = 0;
  bool same = false;
  PetscFunctionBegin;
  *yes = true;
  for (const SavedState::Parts* all : {&from.state, &from.memory}) {
    PetscCall(all == &from.state ? system.gather_state(system.initial_state(), &parts) : system.gather_memory(&parts));
    PetscCall(same_sizes(*all, from.whole, parts, &same, &present));
    *yes = *yes && same && present == parts.size() && present == all->size();
  }
  PetscCall(on_some_rank(system.comm(), !*yes, &same));
  *yes = !same;
  PetscFunctionReturn(0);
}

PetscErrorCode put_memory(System& system, const SavedState& from) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(system.gather_memory(&parts));
  PetscCall(put_parts(system.comm(), from.memory, from.whole, parts));
  if (!parts.empty()) PetscCall(system.scatter_memory());
  PetscFunctionReturn(0);
}

PetscErrorCode put_state(System& system, const SavedState& from, Vec y) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(system.gather_state(system.initial_state(), &parts));  // for their vectors
  PetscCall(put_parts(system.comm(), from.state, from.whole, parts));
  PetscCall(system.scatter_state(y));
  PetscCall(put_memory(system, from));
  system.restore_sums(from.sums);
  PetscFunctionReturn(0);
}

}  // namespace bs
