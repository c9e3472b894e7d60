// What every lattice must fulfil, wherever it comes from. All faults are of the user's making: exit 2.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include "lattice/lattice.hpp"

namespace bs {

/// Collective, the same arguments on every rank. Whether the numbers of rows fit PETSc's indices (and are not 0).
PetscErrorCode check_sizes(MPI_Comm comm, const std::string& source, std::int64_t particles, int dim, std::int64_t springs, std::int64_t anchors);

/// Collective. Sizes, numbers of particles, springs and anchors, their ends and lengths, interactions; rest lengths that are NaN become the initial
/// distance.
PetscErrorCode validate(MPI_Comm comm, Lattice* lattice);

}  // namespace bs
