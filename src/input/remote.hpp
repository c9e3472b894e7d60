// Rows of a distributed table that other ranks hold; a lattice as a whole on one rank, and the chunks of it that the ranks hold.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// Collective. out (wanted.size(), width) receives the rows `wanted` (each in [0, rows.total), any order, repeats
/// allowed) of a table (rows.total, width) of which each rank holds the chunk of split_rows in `values`.
PetscErrorCode fetch_rows(MPI_Comm comm, const Rows& rows, const std::vector<double>& values, int width, const std::vector<std::int64_t>& wanted,
                          std::vector<double>* out);

/// Collective. Sets first and total of `rows` from the counts of all ranks, in rank order.
PetscErrorCode number_rows(MPI_Comm comm, Rows* rows);

/// The chunk of rank `rank` of `size` of a lattice that is whole.
Lattice chunk_of(const Lattice& whole, int rank, int size);

/// Collective. The whole of the chunks of all ranks, on every rank. Error: no memory for it.
PetscErrorCode gather_whole(MPI_Comm comm, const Lattice& chunk, Lattice* whole);

}  // namespace bs
