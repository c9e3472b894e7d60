// The tables that the text of a motion names.
#pragma once
#include <petscsys.h>
#include <string>

#include "physics/whole/drive.hpp"

namespace bs {

/// Collective. Reads the files that `drive` names, given by `option`. Errors (exit 2): files that are not there or are no tables to follow.
PetscErrorCode read_drive_tables(MPI_Comm comm, const std::string& option, Drive* drive);

}  // namespace bs
