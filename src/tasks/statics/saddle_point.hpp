// Directions in which an equilibrium is unstable, and the first step away from it.
#pragma once
#include <petscts.h>
#include "systems/equilibrium.hpp"

namespace bs {

/// Collective. How many eigenvalues of -K are below 0 beyond their rounding errors, by the inertia of the tangent at the equilibrium y of time t,
/// with the matrix J of `ts`, which is changed; -1: an iterative solver cannot count them.
PetscErrorCode count_unstable_directions(TS ts, Mat J, Equilibrium& model, double t, Vec y, PetscInt* negative);

/// Collective. Whether the equilibrium y of time t is unstable by the inertia of the tangent there, with the matrix J of `ts`, which is changed.
/// `negative`: eigenvalues of -K below 0 beyond their rounding errors; -1: an iterative solver cannot count them, and at most `iterations` look for a
/// direction. z: a direction of positions in which the energy falls to second order, where `found`.
PetscErrorCode find_unstable_direction(TS ts, Mat J, Equilibrium& model, double t, Vec y, PetscInt iterations, Vec z, PetscInt* negative,
                                       bool* found);

/// Collective. The same for an iterative solver alone, at the tangent that linearise_sharply() has made.
PetscErrorCode search_unstable_direction(TS ts, Equilibrium& model, PetscInt iterations, Vec z, bool* found);

/// Collective. `out`: at rest, where the energy is least among trial steps of either sense from y along z, none of which turns a spring by more than
/// half a radian. lower: false where it is nowhere lower than at y beyond rounding errors.
PetscErrorCode step_down(Equilibrium& model, double t, Vec y, Vec z, Vec out, bool* lower);

}  // namespace bs
