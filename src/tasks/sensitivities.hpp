// Derivatives of a quantity of an equilibrium by the numbers of its springs.
#pragma once
#include <petscts.h>
#include <vector>
#include "systems/equilibrium.hpp"

namespace bs {

/// Collective. J is some function of the positions at the equilibrium y of load time t, with slopes dJ/dx, `slope`: this rank's rows of the
/// particles, (n, d), in the input's order. The adjoint state: K lambda = -dJ/dx, K = df/dx symmetric, 0 where components are held, laid out as a
/// state. Then
///   dJ/dp = lambda . df/dp
/// for any number p that forces depend on. `ts`, `J`: of the static run; linear solvers are afterwards what they were.
/// Errors: forces without a symmetric tangent, a box under given stresses, bodies that are tied to nothing (exit 2); a tangent with motions that
/// meet no resistance along which J changes (exit 3).
PetscErrorCode find_adjoint(TS ts, Mat J, Equilibrium& model, double t, Vec y, const std::vector<double>& slope, Vec lambda);

}  // namespace bs
