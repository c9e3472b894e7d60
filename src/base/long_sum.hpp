// Sums over the ranks of more numbers than an MPI count can hold.
#pragma once
#include <petscsys.h>
#include <cstddef>

namespace bs {

/// Collective. Replaces `count` numbers by their sums over the ranks, at most `piece` in one reduction.
PetscErrorCode sum_over_ranks(MPI_Comm comm, double* values, std::size_t count, std::size_t piece = std::size_t{1} << 27);

}  // namespace bs
