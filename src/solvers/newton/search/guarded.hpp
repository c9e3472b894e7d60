// The search along a Newton direction by residual norms: full steps at first, backtracking later.
#pragma once
#include "solvers/newton/convergence.hpp"

namespace bs {

/// Collective. From the state and direction of `line`: full steps for the first iterations, then backtracking.
PetscErrorCode guarded_search(SNESLineSearch line, const NewtonPolicy& newton);

}  // namespace bs
