// Options that no part of the program has read: reported before the first step, and again at the end.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>

namespace bs {

/// Names of options never used so far, without those PETSc reads only at the end.
PetscErrorCode unused_options(std::vector<std::string>* names);

/// Collective. Warns about every one of them.
PetscErrorCode warn_unused_options(MPI_Comm comm);

}  // namespace bs
