#include "tasks/zero_modes.hpp"
#include "tasks/tangent_factors.hpp"

namespace bs {

PetscErrorCode count_zero_modes(Linearisation& lin, PetscInt* count) {
  constexpr double NOTHING = 1e-9;
  TangentFactors factors;
  PetscInt below[2] = {0, 0};
  PetscFunctionBegin;
  *count = -1;
  PetscCall(factors.create(lin));
  below[0] = lin.unknowns();
  for (int k = 0; k < 2 && factors.mean() > 0; ++k) {
    bool good = false;
    PetscCall(factors.factor_raised(k == 0 ? -NOTHING : NOTHING, &good));
    if (!good) PetscFunctionReturn(0);
    PetscCall(factors.negative_pivots(&below[k]));
  }
  *count = below[0] - below[1] - lin.layout().dim;
  PetscFunctionReturn(0);
}

}  // namespace bs
