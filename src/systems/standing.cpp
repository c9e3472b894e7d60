#include "systems/standing.hpp"
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "systems/frame_rows.hpp"

namespace bs {
namespace {

PetscErrorCode read_parts(MPI_Comm comm, const std::vector<StatePart>& parts, std::vector<std::vector<double>>* out) {
  std::vector<double> own;
  PetscFunctionBegin;
  out->resize(parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    PetscCall(own_numbers(parts[k].vec, &own));
    PetscCall(gather_all(comm, own, &(*out)[k]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode fill_parts(MPI_Comm comm, const std::vector<std::vector<double>>& all, const std::vector<StatePart>& parts) {
  bool same = all.size() == parts.size();
  PetscInt size = 0, first = 0, end = 0;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < parts.size() && same; ++k) {
    PetscCall(VecGetSize(parts[k].vec, &size));
    same = all[k].size() == static_cast<std::size_t>(size);
  }
  if (!same) PetscCall(fail(comm, Exit::input, "the state is one of another system: leave out options that give springs limits or histories"));
  for (std::size_t k = 0; k < parts.size(); ++k) {
    PetscCall(VecGetOwnershipRange(parts[k].vec, &first, &end));
    std::copy(all[k].begin() + first, all[k].begin() + end, WriteArray(parts[k].vec).data());
  }
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_standing(System& system, double time, Vec y, Standing* out) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  out->time = time;
  PetscCall(system.gather_state(y, &parts));
  PetscCall(read_parts(system.comm(), parts, &out->state));
  PetscCall(system.gather_memory(&parts));
  PetscCall(read_parts(system.comm(), parts, &out->memory));
  out->sums.clear();
  system.save_sums(&out->sums);
  PetscFunctionReturn(0);
}

PetscErrorCode stand_at(System& system, const Standing& from, Vec y) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(system.gather_state(y, &parts));  // for their vectors
  PetscCall(fill_parts(system.comm(), from.state, parts));
  PetscCall(system.scatter_state(y));
  PetscCall(system.gather_memory(&parts));
  PetscCall(fill_parts(system.comm(), from.memory, parts));
  if (!parts.empty()) PetscCall(system.scatter_memory());
  system.restore_sums(from.sums);
  PetscFunctionReturn(0);
}

}  // namespace bs
