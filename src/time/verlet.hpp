// Velocity Verlet as a TS type: half a kick, a drift, the other half of the kick.
#pragma once
#include <petscts.h>

namespace bs {

/// Registers `-ts_type verlet`. State blocks are (x, v) of 2d numbers, RHSFunction is G = (v, a), a = M^-1 f(t, x, v):
///   v_h = v_n + h/2 a_n,  x_{n+1} = x_n + h v_h,
///   a_{n+1} = M^-1 f(t_{n+1}, x_{n+1}, v_h + h/2 a_n),  v_{n+1} = v_h + h/2 a_{n+1}
/// One evaluation of the forces a step: a_{n+1} is kept for the next one. Without forces that depend on velocities it is
/// time-reversible and symplectic. With them, a_{n+1} is taken at the velocity v_n + h a_n, which is off by h^2 and makes an
/// error of h^3 in a step: order 2 either way. On x'' = -w^2 x - c x' it is stable while (h w)^2 + 4 h c < 4.
PetscErrorCode register_verlet();

}  // namespace bs
