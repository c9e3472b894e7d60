// What a sparse Cholesky factorisation of S would cost, from the graph of its couplings alone.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <vector>

namespace bs {

/// Collective. Floating-point operations of a Cholesky factorisation of S, whose d x d blocks couple points, in the order of a nested dissection.
/// row: the owned points' numbers in an order of all points that does not depend on the ranks; ends: pairs of global indices that are coupled,
/// any order, repeats allowed. Counted on rank 0 in that order, so that it is the same on any number of ranks; takes memory and time of the
/// order of the factors' entries: for small systems.
PetscErrorCode predict_factor_flops(MPI_Comm comm, int dim, const std::vector<std::int64_t>& row, const std::vector<PetscInt>& ends, double* flops);

}  // namespace bs
