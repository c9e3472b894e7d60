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
/// that reduces the forces |F_v| to the fraction `full_step` is accepted without computing the energy.
PetscErrorCode energy_search(SNESLineSearch line, NewtonPolicy& newton, const EnergyLimits& limits);

/// The line of one search: the states on F_x = 0 along Newton's direction, and what Phi's slope is there. Trials are W = X + lambda line on F_x = 0;
/// a full step is Newton's own in every bit.
struct EnergyLine {
  NewtonPolicy& newton;
  const EnergyLimits& limits;
  Incremental& potential;
  SNES snes = nullptr;
  Vec start = nullptr, Y = nullptr;  ///< Newton's iterate and direction
  Vec X = nullptr, F = nullptr, line = nullptr, W = nullptr, G = nullptr;
  double slope = 0;     ///< F_v . dv at lambda = 0
  double noise = 0;     ///< rounding error of the slope
  PetscReal full = -1;  ///< |G| while W and G are the full step's
  double most = 1;      ///< the largest lambda that forces allow

  /// Collective. X, F and line from Newton's iterate, its residual and its direction.
  PetscErrorCode set_up(Vec residual);
  /// Collective. The trial state and its residual; `fnorm` not finite: a law has no value there.
  PetscErrorCode evaluate(double lambda, PetscReal* fnorm);
  /// Collective. |F_v| at the trial over that of the residual at the start.
  PetscErrorCode forces_left(Vec residual, double* part) const;
  /// Collective. Phi(lambda) - Phi(0) - lambda slope.
  PetscErrorCode beyond_slope(double lambda, PotentialChange* change) const;
  /// Collective. Whether Phi's slope at the trial is well below that at the start.
  PetscErrorCode slope_has_fallen(bool* yes) const;
  /// Collective. W and G become Newton's iterate and residual.
  PetscErrorCode accept(SNESLineSearch search, Vec residual, PetscReal lambda, PetscReal fnorm) const;
};

// The line searches of the program's own, types of SNESLineSearch beside PETSc's:
//   guarded   by residual norms: full steps for ten iterations, then backtracking
//   energy    by the incremental potential of the step (systems/incremental.hpp), where forces have one; else guarded

/// Registers the types with PETSc; once, after PetscInitialize.
PetscErrorCode register_searches();

/// The searches of `snes` use `newton`, which must outlive it.
PetscErrorCode set_search_policy(SNES snes, NewtonPolicy* newton);

/// Whether the search in force goes no further than forces allow (Incremental::largest_lambda).
PetscErrorCode searches_within_limits(SNES snes, bool* yes);

/// A word or two on the search in force.
PetscErrorCode describe_search(SNES snes, std::string* text);

/// Collective. The guarded search, from the state and direction of `line`: full steps, or as long as forces allow, for the first iterations, then
/// backtracking.
PetscErrorCode guarded_search(SNESLineSearch line, const NewtonPolicy& newton);

}  // namespace bs
