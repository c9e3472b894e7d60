// A lattice as a whole on one rank, and the chunks of it that the ranks hold.
#pragma once
#include <petscsys.h>
#include "lattice/lattice.hpp"

namespace bs {

/// The chunk of rank `rank` of `size` of a lattice that is whole.
Lattice chunk_of(const Lattice& whole, int rank, int size);

/// Collective. The whole of the chunks of all ranks, on every rank. Error: no memory for it.
PetscErrorCode gather_whole(MPI_Comm comm, const Lattice& chunk, Lattice* whole);

}  // namespace bs
