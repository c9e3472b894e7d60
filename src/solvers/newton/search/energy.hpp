// The search along a Newton direction by the incremental potential of the step.
#pragma once
#include <string>
#include "solvers/newton/convergence.hpp"

namespace bs {

/// What bounds the search: PETSc's options -snes_linesearch_alpha, _damping, _minlambda, _max_it, _order.
struct EnergyLimits {
  double alpha = 1e-4, damping = 1, min_lambda = 1e-12;
  double full_step = 0.1;  ///< -snes_linesearch_full_step_rtol
  PetscInt most = 40, order = 3;
  PetscViewer monitor = nullptr;
};

/// Empty, or why the step has no potential to search by; residual norms are then used.
std::string lacks_energy(const NewtonSettings& settings);

/// Collective. Along X - lambda Y, brought to where F_x = 0, to a lambda at which Phi is below its highest value at the
/// last iterates by alpha of its slope (Grippo, Lampariello and Lucidi's rule):
///   Phi(lambda) <= max Phi_k + alpha lambda g.dv,   g = F_v at X, dv the direction's velocity
/// Through stiff springs a good step may raise Phi, and the next one more than makes up for it; following their curve with
/// Phi falling at every step costs five times the iterations. Directions that are not descent directions are searched by residual norms; the
/// fifth of them makes a solve fail. A full step
/// that reduces the residual to the fraction `full_step` is accepted without computing the energy.
PetscErrorCode energy_search(SNESLineSearch line, NewtonPolicy& newton, const EnergyLimits& limits);

}  // namespace bs
