// How large residuals of a particle system are, how small they can get, and what went wrong in one.
#include <cmath>
#include <limits>
#include "base/fault.hpp"
#include "model/particles/particle_model.hpp"

namespace bs {

PetscErrorCode ParticleModel::residual_norms(Vec F, ResidualNorms* norms) {
  const PetscScalar* aF = nullptr;
  const PetscInt d = net_.dim, bs = 2 * d;
  *norms = {0, 0};
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(F, &aF));
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt c = 0; c < bs; ++c) (*norms)[c >= d] += aF[i * bs + c] * aF[i * bs + c];
  PetscCall(VecRestoreArrayRead(F, &aF));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, norms->data(), 2, MPI_DOUBLE, MPI_SUM, net_.comm));
  for (double& norm : *norms) norm = std::sqrt(norm);
  PetscFunctionReturn(0);
}

// Rounding of x alone moves the force on a particle by its springs' rates times eps |x|; of v, its momentum; and laws
// that balance (weight and drag) leave the rounding of each.
PetscErrorCode ParticleModel::residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) {
  const PetscInt d = net_.dim;
  *floor = {0, 0};
  PetscFunctionBegin;
  PetscCall(state_.gather(y));
  std::vector<double> size(static_cast<std::size_t>(net_.n));
  physics_->law_sizes(t, state_, size.data());
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt c = 0; c < d; ++c) {
      const double x = std::abs(state_.at(i)[c]), v = std::abs(state_.at(i)[d + c]);
      const double scale = form == Form::momentum ? 1.0 : 1.0 / net_.mass[i];
      const double momentum = net_.fixed[i] ? 0.0 : scale * (2 * rates_[i] * x + net_.mass[i] * sigma * v + size[i]);
      const double kinematic = scale * net_.mass[i] * (sigma * x + v);
      (*floor)[0] += kinematic * kinematic;
      (*floor)[1] += momentum * momentum;
    }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, floor->data(), 2, MPI_DOUBLE, MPI_SUM, net_.comm));
  for (double& norm : *floor) norm = 2 * PETSC_MACHINE_EPSILON * std::sqrt(norm);
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::last_fault(std::string* text) {
  PetscFunctionBegin;
  // the smallest row of the gravest kind speaks for all ranks
  std::int64_t key[2] = {fault_.kind == Singularity::none ? 99 : fault_.kind, fault_.row}, low = 0;
  PetscCallMPI(MPI_Allreduce(&key[0], &low, 1, MPI_INT64_T, MPI_MIN, net_.comm));
  text->clear();
  if (low == 99) PetscFunctionReturn(0);
  std::int64_t row = key[0] == low ? key[1] : std::numeric_limits<std::int64_t>::max();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &row, 1, MPI_INT64_T, MPI_MIN, net_.comm));
  const long long number = static_cast<long long>(row);
  if (low == Singularity::spring) *text = format("spring %lld met zero length, where its law has no direction", number);
  else if (low == Singularity::anchor) *text = format("anchor %lld met zero length, where its law has no direction", number);
  else if (low == Singularity::state) *text = format("Newton or the step led to a state that is not finite, at particle %lld", number);
  else *text = format("a law of force is singular at particle %lld", number);
  PetscFunctionReturn(0);
}

}  // namespace bs
