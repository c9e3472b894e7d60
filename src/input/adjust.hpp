// What options change of a lattice that was read from a file.
#pragma once
#include <petscsys.h>

#include "lattice/generator.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Collective. Adds the groups of `spec`, fixes more particles (faces of the bounding box, single ones), gives all a radius, replaces the initial
/// velocities, each where `spec` asks for it; fixed particles are at rest whatever the file says. Errors (exit 2): see check_particle_data.
PetscErrorCode adjust_lattice(MPI_Comm comm, const GeneratorSpec& spec, Lattice* lattice);

/// Collective. Warns of -bs_lattice_ options that are set but say nothing about a lattice from a file.
PetscErrorCode warn_of_idle_options(MPI_Comm comm, const std::string& source);

}  // namespace bs
