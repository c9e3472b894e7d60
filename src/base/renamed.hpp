// Options of the previous version under their old names.
#pragma once
#include <petscsys.h>

namespace bs {

/// Collective. Gives options that are set by an old name their present one, with one notice for each; after PetscInitialize,
/// before the options are read. An option set by both names keeps the value of the present one.
PetscErrorCode rename_old_options(MPI_Comm comm);

}  // namespace bs
