// The motions of a system as a rigid body that its forces do not resist.
#pragma once
#include <vector>
#include "solvers/eigen/standard_form.hpp"

namespace bs {

/// Collective. Orthonormal u = M^1/2 q of those translations and rotations q, and their sums, with K q = 0 at the state `y`
/// that `form` is linearised at: at most 1, 3 or 6 in one, two or three dimensions; less where particles are fixed, held by
/// anchors or on a line. `sizes`: of A (StandardForm::sizes).
PetscErrorCode rigid_motions(StandardForm& form, Vec y, Vec sizes, std::vector<VecHandle>* u);

}  // namespace bs
