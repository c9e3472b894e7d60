// The particles' columns on their way from the lattice's chunks to the network.
#pragma once
#include <petscsys.h>
#include "lattice/lattice.hpp"
#include "network/network.hpp"

namespace bs {

/// Collective. Gives the owned particles of `net`, which are laid out, the numbers in the lattice's columns.
PetscErrorCode give_columns(MPI_Comm comm, const Lattice& lattice, Network* net);

}  // namespace bs
