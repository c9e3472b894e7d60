// What every lattice must fulfil, wherever it comes from. All faults are of the user's making: exit 2.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>

#include "lattice/lattice.hpp"

namespace bs {

/// Collective, the same arguments on every rank. Whether the numbers of rows fit PETSc's indices (and are not 0).
PetscErrorCode check_sizes(MPI_Comm comm, const std::string& source, std::int64_t particles, int dim, std::int64_t springs, std::int64_t anchors);

/// Collective. Chunk-local checks: finite positions and velocities, mass > 0, columns in their range, ends of springs and anchors
/// that exist and differ, stiffness, damping, rest length >= 0 and finite (NaN of a spring: the initial distance).
PetscErrorCode check_values(MPI_Comm comm, const Lattice& lattice);

/// Collective. Initial distance [m] between the ends of each spring, and between particle and point of each anchor, of
/// this chunk. Needs ends that exist.
PetscErrorCode initial_lengths(MPI_Comm comm, const Lattice& lattice, std::vector<double>* springs, std::vector<double>* anchors);

/// Collective. Springs and anchors whose ends are at one place need a rest length of 0, and damping that has a direction.
PetscErrorCode check_lengths(MPI_Comm comm, const Lattice& lattice, const std::vector<double>& springs, const std::vector<double>& anchors);

/// Collective. All of the above.
PetscErrorCode validate(MPI_Comm comm, const Lattice& lattice);

/// Collective. All of the above, and rest lengths that are NaN become the initial distance.
PetscErrorCode validate_and_fill(MPI_Comm comm, Lattice* lattice);

}  // namespace bs
