// The motions of a system as a rigid body that its forces do not resist.
#pragma once
#include <vector>
#include "solvers/eigen/standard_form.hpp"

namespace bs {

/// Collective. Orthonormal u = M^1/2 q of those translations and rotations q, and their sums, with K q = 0 at the state `y`
/// that `form` is linearised at: at most 1, 3 or 6 in one, two or three dimensions; less where particles are fixed, held by
/// anchors or on a line. `diagonal`: of A.
PetscErrorCode rigid_motions(StandardForm& form, Vec y, Vec diagonal, std::vector<VecHandle>* u);

}  // namespace bs
