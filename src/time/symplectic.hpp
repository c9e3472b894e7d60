// Symplectic Euler as a TS type: velocity first, then position with the new velocity.
#pragma once
#include <petscts.h>

namespace bs {

/// Registers `-ts_type symplectic`. State blocks are (x, v) of 2d numbers, RHSFunction is G = (v, M^-1 f); PETSc's own
/// TSBASICSYMPLECTIC passes no velocity to the force, so drag and dampers need this one.
PetscErrorCode register_symplectic();

}  // namespace bs
