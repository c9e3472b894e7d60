// Nothing that is not finite is written.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>

#include "systems/system.hpp"

namespace bs {

/// Collective. The first quantity of a frame that is not finite, with its row, in words; empty: all of it is finite.
PetscErrorCode find_not_finite(MPI_Comm comm, const std::vector<Field>& fields, const std::vector<Observable>& observables, std::string* what);

/// Collective. Ends the run with exit code 3 where a table, or a vector that is written under `name`, holds a number that is not finite.
PetscErrorCode require_finite(MPI_Comm comm, const Dataset& table);
PetscErrorCode require_finite(MPI_Comm comm, const std::string& name, Vec vec);

}  // namespace bs
