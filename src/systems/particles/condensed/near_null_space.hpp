// The motions that springs alone do not resist, as algebraic multigrid wants to know them.
#pragma once
#include <petscmat.h>
#include <functional>
#include "network/network.hpp"

namespace bs {

/// Collective. The near null space of S (blocks of d) becomes the d translations and d (d - 1)/2 rotations of the owned particles at
/// position(i) [m], orthonormal and zero on fixed particles; those that move nothing beyond the others (a straight chain turning about
/// itself, a lattice that is all fixed) are left out.
PetscErrorCode set_rigid_modes(const Network& net, const std::function<const double*(PetscInt)>& position, Mat S);

}  // namespace bs
