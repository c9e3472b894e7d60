// The motions that forces between points do not resist, as algebraic multigrid wants to know them.
#pragma once
#include <petscmat.h>
#include "linalg/graph.hpp"

namespace bs {

/// Collective. The near null space of S (blocks of d) becomes the d translations and d (d - 1)/2 rotations of the owned points at
/// position(i) [m], orthonormal and zero on fixed points; those that move nothing beyond the others (a straight chain turning about
/// itself, points that are all fixed) are left out.
PetscErrorCode set_rigid_modes(const Graph& graph, const Places& position, Mat S);

}  // namespace bs
