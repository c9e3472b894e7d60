// Files that PETSc's options name for what they print.
#pragma once
#include <petscsys.h>

namespace bs {

/// Collective. Ends the run with exit code 4, before anything is computed, where a value of the form [ascii|binary|...]:FILE[:...] of an option of
/// PETSc's, such as -log_view :F, names a file that cannot be written; with 2 where PETSc would find at the very end that it cannot read a value.
PetscErrorCode check_viewers(MPI_Comm comm);

}  // namespace bs
