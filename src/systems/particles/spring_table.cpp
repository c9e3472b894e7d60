#include "systems/particles/spring_table.hpp"
#include <cmath>
#include <limits>
#include "systems/particles/spring_exists.hpp"

namespace bs {

PetscErrorCode SpringTable::create(const Network& net, const Rows& rows) {
  std::vector<PetscInt> target;
  VecHandle like;
  ISHandle to;
  PetscFunctionBegin;
  net_ = &net;
  rows_ = static_cast<PetscInt>(rows.count);
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
  PetscCall(VecCreate(net.comm, like.out()));
  PetscCall(VecSetSizes(like, rows_, PETSC_DETERMINE));
  PetscCall(VecSetType(like, VECSTANDARD));
  PetscCall(ISCreateGeneral(net.comm, count, target.data(), PETSC_COPY_VALUES, to.out()));
  PetscCall(VecScatterCreate(local_, nullptr, like, to, scatter_.out()));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringTable::scatter_rows(VecHandle* out) {
  PetscFunctionBegin;
  if (!*out) {
    PetscCall(VecCreate(net_->comm, out->out()));
    PetscCall(VecSetSizes(*out, rows_, PETSC_DETERMINE));
    PetscCall(VecSetType(*out, VECSTANDARD));
  }
  PetscCall(VecScatterBegin(scatter_, local_, *out, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter_, local_, *out, INSERT_VALUES, SCATTER_FORWARD));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringTable::fetch_rows(Vec rows) {
  PetscFunctionBegin;
  if (!back_) {
    std::vector<PetscInt> source;
    ISHandle from;
    for (std::size_t e = 0; e < net_->links.spring.size(); ++e)
      if (net_->links.spring[e] >= 0) {
        every_.push_back(static_cast<PetscInt>(e));
        source.push_back(static_cast<PetscInt>(net_->links.spring[e]));
      }
    const PetscInt count = static_cast<PetscInt>(source.size());
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, count, all_.out()));
    PetscCall(ISCreateGeneral(net_->comm, count, source.data(), PETSC_COPY_VALUES, from.out()));
    PetscCall(VecScatterCreate(rows, from, all_, nullptr, back_.out()));
  }
  PetscCall(VecScatterBegin(back_, rows, all_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(back_, rows, all_, INSERT_VALUES, SCATTER_FORWARD));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringStrain::create(const Network& net, const Rows& rows) {
  PetscFunctionBegin;
  net_ = &net;
  PetscCall(table_.create(net, rows));
  PetscFunctionReturn(0);
}

// strain = (l - L) / L, l = |x_j - x_i|, of springs that there are
PetscErrorCode SpringStrain::compute(const LocalState& state, Vec* strains) {
  PetscFunctionBegin;
  const auto strain = [&](PetscInt i, PetscInt e) {
    const double *a = state.at(i), *b = state.at(net_->links.other[e]);
    const double rest = net_->links.rest_length[e];
    double square = 0;
    for (int c = 0; c < net_->dim; ++c) square += (b[c] - a[c]) * (b[c] - a[c]);
    return rest > 0 && exists(*net_, e) ? (std::sqrt(square) - rest) / rest : std::numeric_limits<double>::quiet_NaN();
  };
  PetscCall(table_.gather(strain, &strains_));
  *strains = strains_;
  PetscFunctionReturn(0);
}

}  // namespace bs
