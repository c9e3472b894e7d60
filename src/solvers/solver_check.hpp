// Solvers that cannot work here, refused by name before PETSc tries them.
#pragma once
#include <petscsys.h>

namespace bs {

/// Collective. Told (exit 2): nonlinear solvers that want a mesh or a function of the user's own, and pairs of options that
/// PETSc 3.18 takes and crashes with.
PetscErrorCode refuse_impossible_solvers(MPI_Comm comm);

}  // namespace bs
