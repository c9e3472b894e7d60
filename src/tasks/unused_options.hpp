// Options that were given and that nothing has read: misspelt, of a solver that is not chosen, or of another task or model than the run's.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>
#include "session/tasks.hpp"

namespace bs {

/// Names of options never used so far, without those PETSc reads only at the end.
PetscErrorCode unused_options(std::vector<std::string>* names);

/// Collective, once the solvers are set up. Warns of every one of them, and says which tasks have it, as far as refuse_foreign_options has found out;
/// options of PETSc's are looked for in a rehearsal of `other`, if that names a task.
PetscErrorCode warn_unused_options(MPI_Comm comm, const Variant& other = {});

/// Collective, once all options of the run have been read. Ends it with exit code 2 where an option of the program's was given that no task has, or
/// that only another task or model has. What the file of a problem may say of its motion, whatever else is computed of it, is left to
/// warn_unused_options.
PetscErrorCode refuse_foreign_options(MPI_Comm comm);

/// Collective, once all options that are of use have been read. Error (exit 2): one of the program's that no task knows.
PetscErrorCode refuse_misspelt_options(MPI_Comm comm);

/// Collective. For a task that makes a lattice alone: warns of all options that it has no use for. Error (exit 2): one that no task knows.
PetscErrorCode warn_of_run_options(MPI_Comm comm);

}  // namespace bs
