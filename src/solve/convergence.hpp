// When Newton has converged and how far it goes along a step: the kinematic and the momentum residual are judged apart,
// since their units differ.
#pragma once
#include <petscts.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include "model/model.hpp"

namespace bs {

/// What energy searches came across.
struct SearchTally {
  std::int64_t cuts = 0;     ///< trials refused
  std::int64_t uphill = 0;   ///< directions along which the potential does not fall: searched by residual norms
};

/// What the energy search remembers of one solve.
struct PastEnergies {
  static constexpr std::size_t MEMORY = 8;
  std::array<double, MEMORY> before{};  ///< Phi at the last iterates, or the first, less Phi now
  std::size_t next = 0;
  PetscInt uphill = 0;                  ///< directions that led uphill
  double highest() const { return std::max(0.0, *std::max_element(before.begin(), before.end())); }
  /// Phi has changed by what nobody knows.
  void forget() { before.fill(0); }
  /// Phi has changed by `change`.
  void moved(double change) {
    before[next] = 0;
    next = (next + 1) % MEMORY;
    for (double& value : before) value -= change;
  }
};

/// Convergence test and line search of one SNES; must outlive it. `floor` is renewed before every attempt at a step.
struct NewtonPolicy {
  Model* model = nullptr;
  ResidualNorms floor = {0, 0};     ///< rounding errors of the residual
  double floor_sigma = 0;           ///< 1/h they were estimated for [1/s]
  Form form = Form::momentum;
  ResidualNorms first = {0, 0};     ///< residual at the first iterate of this solve
  ResidualNorms previous = {0, 0};  ///< at the iterate before this one
  ResidualNorms reference = {0, 0}; ///< residual where the step began, if Newton starts elsewhere (0: it does not)
  double sigma = 1;                 ///< 1/h of this attempt [1/s]: makes the kinematic residual a force
  double stage_time = 0, stage_sigma = 0;  ///< of the last Jacobian; sigma 0: there was none
  double residual_time = 0;         ///< of the last residual
  bool affine = false;              ///< the type solves F(t, y, sigma y + c) = b for y in momentum form
  SearchTally tally;
  PastEnergies past;
  /// Largest force the first residual stands for [N]: a kinematic residual r is worth sigma r, the velocity it stands
  /// for brought up within a step.
  double size_of_forces() const { return std::max(sigma * first[0], first[1]); }
  /// Whether linear solves are as loose as Newton allows (set for the iterative condensed solve).
  bool forcing = false;
  /// Whether the search makes do with descent directions of the potential in place of solutions of Newton's system.
  bool directions = false;
  PetscInt definite_before = 0;     ///< directions from definite parts before this solve
  PetscInt indefinite_before = 0;   ///< tangents that were not positive definite before it
  std::int64_t at_floor = 0;        ///< solves that ended at rounding level, above -snes_rtol
  std::int64_t uneven = 0;          ///< iterates that were good by the norms over everything, not for every particle
  /// Sets the test, and the line search unless -snes_linesearch_type or another -snes_type is asked for.
  PetscErrorCode attach(TS ts, SNES snes);
  /// Collective. Rounding errors near the state `ts` is at, for an attempt of 1/sigma [s].
  PetscErrorCode estimate_floor(double sigma);
  TS ts = nullptr;
};

}  // namespace bs
