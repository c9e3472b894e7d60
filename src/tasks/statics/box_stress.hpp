// Components of a periodic box that are free under a given stress: -bs_box_stress in static analyses.
#pragma once
#include <petscts.h>
#include <vector>
#include "base/error.hpp"
#include "systems/equilibrium.hpp"
#include "tasks/result.hpp"
#include "tasks/statics/statics.hpp"
#include "tasks/strain_relaxation.hpp"
#include "time/ts_setup.hpp"

namespace bs {

class PseudoTime;

/// What may be missing to a given stress, of the largest that is given, or, where these are 0, of the largest there is: more is no equilibrium.
inline constexpr double BOX_STRESS_MISSED = 1e-6;

/// Newton's method for the free strains around the solve of every load step: at the equilibrium of the particles for given strains, box_tangent()
/// says how the stress changes, and the step that meets the given one also moves the particles, by L x and what they relax. Where the box is not
/// stable against the free strains, the step follows the missing stress instead; an unstable equilibrium is refused.
class BoxStress {
 public:
  /// Collective. Errors (exit 2): free strains by arc length, of particles that are held, where only minima are asked for.
  PetscErrorCode begin(Equilibrium& model, const StaticsSettings& settings);
  bool active() const { return active_; }
  /// Collective. `inner` solves for the particles alone in the place of SNES's solve; the arguments must outlive the solver.
  PetscErrorCode attach(TS ts, TSContext& context, Equilibrium& model, PseudoTime& inner);
  /// Collective. In the place of SNES's solve.
  PetscErrorCode solve(SNES snes);
  /// The state of the next load step was come to without a step.
  void begin_anew() { from_ = -1; }
  std::int64_t corrections() const { return corrections_; }
  /// Collective. Whether the stress at the equilibrium y of time t, computed anew, is the given one; else `out` says why not.
  PetscErrorCode confirm(Equilibrium& model, double t, Vec y, FinalResults* out) const;
  PetscErrorCode warn(Equilibrium& model, double t, Warnings* warnings) const;
  /// The strains found, for the summary and the report.
  void put(Equilibrium& model, double t, FinalResults* out) const;

 private:
  /// The equilibrium at given strains.
  struct Trial {
    double worst = 0;  ///< of what is missing to the given stresses
    bool met = false;  ///< they are
    BoxState state = BoxState::neutral;
    std::vector<double> step;  ///< of the free strains, to meet them
    double volume_ratio = 1;   ///< to the box at the start of the load step
  };
  PetscErrorCode begin_step();
  PetscErrorCode iterate(SNES snes, bool* found);
  PetscErrorCode judge(Vec X, Trial* out);
  double missing(const StrainResponse& at, const std::vector<FreeStrain>& free, std::vector<double>* each, double* scale) const;
  double flow_size(const std::vector<double>& step) const;
  PetscErrorCode move(const Trial& from, double part, Vec X);
  PetscErrorCode refuse(SNES snes, const char* why);

  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  Equilibrium* model_ = nullptr;
  PseudoTime* inner_ = nullptr;
  StrainRelaxation relaxed_;
  std::vector<FreeStrain> free_;      ///< as they are, with the stresses of this load step
  std::vector<double> start_, good_;  ///< strains where the load step began, and at the last equilibrium looked at
  VecHandle good_state_;
  double rtol_ = 0, from_ = -1, time_ = 0;
  bool active_ = false;
  std::int64_t corrections_ = 0;
};

/// Collective. For tasks that find no strains: ends the run with exit code 2 where some are free.
PetscErrorCode refuse_box_stress(Model& model, const char* task);

}  // namespace bs
