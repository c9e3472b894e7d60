// What a sparse Cholesky factorisation of S would cost, from the graph of the springs alone.
#pragma once
#include <petscsys.h>
#include "network/network.hpp"

namespace bs {

/// Collective. Floating-point operations of a Cholesky factorisation of S, whose d x d blocks couple linked free particles, in the order
/// of a nested dissection. Counted on rank 0 in the order of the input, so that it is the same on any number of ranks; takes memory
/// and time of the order of the factors' entries: for small systems.
PetscErrorCode predict_factor_flops(const Network& net, double* flops);

}  // namespace bs
