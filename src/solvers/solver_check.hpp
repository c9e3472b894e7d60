// Solvers that cannot be used here are refused by name before PETSc tries them.
#pragma once
#include <petscsys.h>

namespace bs {

/// Collective. Ends the run with exit code 2 for nonlinear solvers that need a mesh or a user function, and for pairs of options that
/// PETSc 3.18 accepts and then crashes on.
PetscErrorCode refuse_impossible_solvers(MPI_Comm comm);

}  // namespace bs
