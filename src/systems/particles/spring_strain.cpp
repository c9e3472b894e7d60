#include "systems/particles/spring_strain.hpp"
#include <cmath>
#include <limits>
#include "systems/particles/spring_exists.hpp"

namespace bs {

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
