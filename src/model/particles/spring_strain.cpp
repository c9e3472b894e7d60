#include "model/particles/spring_strain.hpp"
#include <cmath>
#include <limits>

namespace bs {

PetscErrorCode SpringStrain::create(const Network& net, const Rows& rows) {
  std::vector<PetscInt> target;
  ISHandle to;
  PetscFunctionBegin;
  net_ = &net;
  // a spring is in the rows of both its ends: the end of the lower global index evaluates it
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt k = net.links.start[i]; k < net.links.start[i + 1]; ++k) {
      if (net.links.spring[k] < 0 || net.global[i] > net.global[net.links.other[k]]) continue;
      particle_.push_back(i);
      link_.push_back(k);
      target.push_back(static_cast<PetscInt>(net.links.spring[k]));
    }
  const PetscInt count = static_cast<PetscInt>(target.size());
  PetscCall(VecCreate(net.comm, local_.out()));
  PetscCall(VecSetSizes(local_, count, PETSC_DETERMINE));
  PetscCall(VecSetType(local_, VECSTANDARD));
  PetscCall(VecCreate(net.comm, strains_.out()));
  PetscCall(VecSetSizes(strains_, static_cast<PetscInt>(rows.count), PETSC_DETERMINE));
  PetscCall(VecSetType(strains_, VECSTANDARD));
  PetscCall(ISCreateGeneral(net.comm, count, target.data(), PETSC_COPY_VALUES, to.out()));
  PetscCall(VecScatterCreate(local_, nullptr, strains_, to, scatter_.out()));
  PetscFunctionReturn(0);
}

// strain = (l - L) / L, l = |x_j - x_i|
PetscErrorCode SpringStrain::compute(const LocalState& state, Vec* strains) {
  PetscScalar* values;
  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(local_, &values));
  for (std::size_t s = 0; s < link_.size(); ++s) {
    const double *a = state.at(particle_[s]), *b = state.at(net_->links.other[link_[s]]);
    const double rest = net_->links.rest_length[link_[s]];
    double square = 0;
    for (int c = 0; c < net_->dim; ++c) square += (b[c] - a[c]) * (b[c] - a[c]);
    values[s] = rest > 0 ? (std::sqrt(square) - rest) / rest : std::numeric_limits<double>::quiet_NaN();
  }
  PetscCall(VecRestoreArrayWrite(local_, &values));
  PetscCall(VecScatterBegin(scatter_, local_, strains_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter_, local_, strains_, INSERT_VALUES, SCATTER_FORWARD));
  *strains = strains_;
  PetscFunctionReturn(0);
}

}  // namespace bs
