#include "systems/mechanics.hpp"
#include "base/vec_array.hpp"
#include "systems/model.hpp"

namespace bs {

std::unique_ptr<Mechanics> Model::take_mechanics() { return nullptr; }

PetscErrorCode Linearisation::multiply(const Coefficients& k, Vec z, Vec out) {
  const Layout& at = layout();
  const std::vector<double>& m = masses();
  PetscScalar* both = nullptr;
  PetscFunctionBegin;
  if (!room_) PetscCall(VecDuplicate(state_vector(), room_.out()));
  force_.resize(static_cast<std::size_t>(at.particles * at.dim));
  const ReadArray az(z);
  PetscCall(VecGetArrayWrite(room_, &both));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      both[at.x(i, c)] = k.stiffness * az[i * at.dim + c];
      both[at.v(i, c)] = k.damping * az[i * at.dim + c];
    }
  PetscCall(VecRestoreArrayWrite(room_, &both));
  PetscCall(change_of_force(room_, force_.data()));
  const WriteArray a(out);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt e = i * at.dim; e < (i + 1) * at.dim; ++e)
      a[e] = k.mass * m[static_cast<std::size_t>(i)] * az[e] - force_[static_cast<std::size_t>(e)];
  PetscFunctionReturn(0);
}

}  // namespace bs
