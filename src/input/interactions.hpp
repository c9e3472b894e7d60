// Interactions of several particles in HDF5 files, and what they must fulfil. Errors: exit 2.
#pragma once
#include <petscsys.h>

#include "input/hdf5_file.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

/// Paths of the datasets of one kind: the rows of particles, and a parameter.
std::string topology_path(const InteractionSchema& schema, bool trajectory);
std::string parameter_path(const InteractionSchema& schema, const std::string& name, bool trajectory);

/// Collective. Each rank reads its rows of every kind the file has (/angles of a lattice, /connectivity/angles of a trajectory),
/// once the particles are known.
PetscErrorCode read_interactions(MPI_Comm comm, const Hdf5File& file, bool trajectory, Lattice* lattice);

/// Collective. Ends that exist and differ, parameters the law allows, places where it has a force.
PetscErrorCode check_interactions(MPI_Comm comm, const Lattice& lattice);

}  // namespace bs
