// A lattice as a whole on one rank, and the chunks of it that the ranks hold.
#pragma once
#include <petscsys.h>
#include "lattice/lattice.hpp"
#include "network/migrate.hpp"

namespace bs {

/// Collective. Sets first and total of `rows` from the counts of all ranks, in rank order.
PetscErrorCode number_rows(MPI_Comm comm, Rows* rows);

/// The chunk of rank `rank` of `size` of a lattice that is whole.
Lattice chunk_of(const Lattice& whole, int rank, int size);

/// Collective. The whole of the chunks of all ranks, on every rank. Error: no memory for it.
PetscErrorCode gather_whole(MPI_Comm comm, const Lattice& chunk, Lattice* whole);

}  // namespace bs
