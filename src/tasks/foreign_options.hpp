// Options of another task or model than the run's.
#pragma once
#include <petscsys.h>

namespace bs {

/// Collective, once all options of the run have been read. Ends it with exit code 2 where one was given that only another task or model reads.
PetscErrorCode refuse_foreign_options(MPI_Comm comm);

}  // namespace bs
