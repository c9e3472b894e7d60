// The motions that forces between points do not resist, as algebraic multigrid and the search for modes want to know them.
#pragma once
#include <petscmat.h>
#include <vector>
#include "base/handle.hpp"
#include "linalg/graph.hpp"

namespace bs {

/// Local. Motion k of n points at position(i), blocks of d: k < d: u = e_k; k >= d, in the plane of axes (a, b): u_a = -(x_b - c_b)/radius,
/// u_b = (x_a - c_a)/radius.
PetscErrorCode fill_rigid_mode(int d, PetscInt n, const Places& position, const double* centre, double radius, int k, Vec mode);

/// Collective. Adds u to the orthonormal set unless what is no sum of those there is but rounding beside `size`; u is lost.
PetscErrorCode add_orthonormal(Vec u, PetscReal size, std::vector<VecHandle>* set);

/// Collective. The near null space of S (blocks of d) becomes the d translations and d (d - 1)/2 rotations of the owned points at
/// position(i) [m], orthonormal and zero on fixed points; those that move nothing beyond the others (a straight chain turning about
/// itself, points that are all fixed) are left out.
PetscErrorCode set_rigid_modes(const Graph& graph, const Places& position, Mat S);

}  // namespace bs
