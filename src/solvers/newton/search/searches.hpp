// The line searches of the program's own, types of SNESLineSearch beside PETSc's:
//   guarded   by residual norms: full steps for ten iterations, then backtracking
//   energy    by the incremental potential of the step (systems/incremental.hpp), where forces have one; else guarded
#pragma once
#include "solvers/newton/convergence.hpp"

namespace bs {

/// Registers the types with PETSc; once, after PetscInitialize.
PetscErrorCode register_searches();

/// The searches of `snes` use `newton`, which must outlive it.
PetscErrorCode set_search_policy(SNES snes, NewtonPolicy* newton);

/// A word or two on the search in force.
PetscErrorCode describe_search(SNES snes, std::string* text);

/// Collective. The guarded search, from the state and direction of `line`: full steps for the first iterations, then backtracking.
PetscErrorCode guarded_search(SNESLineSearch line, const NewtonPolicy& newton);

}  // namespace bs
