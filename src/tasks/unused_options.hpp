// Options that were given and that nothing has read: misspelt, of a solver that is not chosen, or of another task or model than the run's.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>

namespace bs {

/// Names of options never used so far, without those PETSc reads only at the end.
PetscErrorCode unused_options(std::vector<std::string>* names);

/// Collective. Warns about every one of them.
PetscErrorCode warn_unused_options(MPI_Comm comm);

/// Collective, once all options of the run have been read. Ends it with exit code 2 where one was given that only another task or model reads.
PetscErrorCode refuse_foreign_options(MPI_Comm comm);

}  // namespace bs
