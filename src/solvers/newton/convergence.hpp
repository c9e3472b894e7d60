// The convergence test of Newton's method: the kinematic and the momentum residual are tested separately, since their units differ.
#pragma once
#include <petscsnes.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include "base/facts.hpp"
#include "base/handle.hpp"
#include "systems/model.hpp"

namespace bs {

/// The attempt that a solve belongs to.
struct NewtonStep {
  double time = 0;      ///< where it starts [s]
  double h = 1;         ///< its length [s]
  Vec start = nullptr;  ///< the state it starts from, borrowed
};

/// Settings of Newton's method; set once, before the first solve.
struct NewtonSettings {
  Model* model = nullptr;
  std::function<PetscErrorCode(NewtonStep*)> step = {};  ///< the attempt under way
  Form form = Form::momentum;
  bool affine = false;  ///< the type solves F(t, y, sigma y + c) = b for y in momentum form
  /// Whether descent directions of the potential are sufficient for the search, instead of solutions of Newton's system.
  bool directions = false;
  /// Whether linear solves are as loose as Newton allows (set for the iterative condensed solve).
  bool forcing = false;
};

/// Data of one Newton solve. Written by NewtonPolicy only.
struct NewtonSolve {
  ResidualNorms first = {0, 0};     ///< residual at the first iterate, or where the step began if that is larger
  ResidualNorms previous = {0, 0};  ///< at the iterate before this one
  ResidualNorms floor = {0, 0};     ///< rounding errors of the residual
  ResidualNorms least = {0, 0};     ///< smallest so far, each part renewed where it has been halved
  double worst = 0;                 ///< smallest so far of what the worst particle was left with, where that was asked; 0: it was not
  int stalled = 0;                  ///< iterates in a row that halved none of these
  double fallen = 0;                ///< by how much the potential had fallen when the solve last made progress [J]
  int idle = 0;                     ///< iterates in a row without progress: none halved, and the potential's fall not a hundredth greater
  double inverse_h = 1;             ///< 1/h of this attempt [1/s]: makes the kinematic residual a force
  /// Largest force the first residual stands for [N]: a kinematic residual r is worth r/h, the velocity it stands
  /// for brought up within a step.
  double size_of_forces() const { return std::max(inverse_h * first[0], first[1]); }
  /// The residual is `now` at another iterate, where the potential is lower than at the first by `fall`.
  void follow(const ResidualNorms& now, double fall);
};

/// Data of the stage that is solved for. Written by the callbacks of the residual and the Jacobian only.
struct NewtonStage {
  double residual_time = 0;    ///< of the last residual
  double time = 0, sigma = 0;  ///< of the last Jacobian, and its shift; sigma 0: there was none
  /// Whether the last Jacobian is of the stage whose residual was the last.
  bool has_jacobian() const { return sigma > 0 && time == residual_time; }
};

/// Data of the energy search that last for one solve.
struct PastEnergies {
  static constexpr std::size_t MEMORY = 8;
  std::array<double, MEMORY> before{};  ///< Phi at the last iterates, or the first, less Phi now
  std::size_t next = 0;
  PetscInt uphill = 0;  ///< directions that led uphill
  double fall = 0;      ///< by how much Phi has fallen since the first iterate, as far as that is known
  double highest() const { return std::max(0.0, *std::max_element(before.begin(), before.end())); }
  /// Phi has changed by an unknown amount.
  void forget() { before.fill(0); }
  /// Phi has changed by `change`.
  void moved(double change) {
    before[next] = 0;
    next = (next + 1) % MEMORY;
    for (double& value : before) value -= change;
    fall -= change;
  }
};

/// What steps of several lengths took, since one was rejected.
struct PastLengths {
  double h = 0;       ///< of the present solve [s]
  bool open = false;  ///< it has not converged
  double failed = 0;  ///< the shortest that was rejected, as long as none as long has succeeded [s]; 0: none
  double rate = 0;    ///< Newton iterations of the last shorter one that succeeded, by its length [1/s]
  void begin(double length);
  void converged(PetscInt iterations);
  /// Whether that many iterations are more than shorter steps over the same time would take.
  bool exceeded(PetscInt iterations) const;
};

/// State of the energy search. Written by search/energy.cpp only.
struct SearchMemory {
  PastEnergies past;
  std::int64_t cuts = 0;          ///< trials refused
  std::int64_t uphill = 0;        ///< directions along which the potential does not fall: searched by residual norms
  std::array<VecHandle, 3> work;  ///< of the line; made once, as SNESLineSearchSetWorkVecs leaves those it made before
};

/// Convergence test of one SNES, and the data that its line search needs; must outlive it.
class NewtonPolicy {
 public:
  NewtonStage stage;
  SearchMemory search;

  /// Sets the test, and the line search unless -snes_linesearch_type or another -snes_type is given.
  /// `settings.directions` is determined here.
  PetscErrorCode attach(SNES snes, const NewtonSettings& settings);
  void loosen_linear_solves() { settings_.forcing = true; }
  /// Whether solves may take all of -snes_max_it whatever shorter steps took, and whatever progress they make (pseudo time).
  void allow_all_iterations(bool on) { all_iterations_ = on; }
  /// What a checkpoint holds of it: what steps of several lengths took; and back, where it holds that.
  void save(Facts* facts) const;
  void restore(const Facts& facts);
  /// Of equilibria, whose forces are judged once more when the solve has ended: near rounding level a solve goes on for as long as the residual
  /// falls at all, and may then leave particles that are worse than the others.
  void iterate_to_rounding(bool on) { to_rounding_ = on; }
  /// Solves give up after so many iterates in a row without progress; 0: however many there are.
  void give_up_after(int idle) { longest_idle_ = idle; }
  /// After solves that are no steps: what they took is forgotten.
  void forget_lengths() { lengths_ = {}; }
  const NewtonSettings& settings() const { return settings_; }
  const NewtonSolve& solve() const { return solve_; }
  Model& model() const { return *settings_.model; }
  /// Rounding errors of the residual, as estimated last.
  const ResidualNorms& floor() const { return solve_.floor; }
  /// Collective. Rounding errors near the state that the step starts from, for an attempt of length 1/inverse_h [s]: before every attempt.
  PetscErrorCode estimate_floor(double inverse_h);
  /// The next solve does not start where the step began: the residual there.
  void set_reference(const ResidualNorms& norms) { reference_ = norms; }
  /// Why the last solve that ended by SNES_DIVERGED_INNER did.
  const std::string& gave_up() const { return gave_up_; }
  std::int64_t at_floor() const { return at_floor_; }  ///< solves that ended at rounding level, above -snes_rtol
  /// Solves that the user's tolerances ended far above rounding level, with more than a thousandth of the residual left.
  std::int64_t loose() const { return loose_; }
  std::int64_t uneven() const { return uneven_; }  ///< iterates that were good by the norms over everything, not for every particle

 private:
  struct Norms;  ///< what SNES hands to its convergence test
  static PetscErrorCode test(SNES snes, PetscInt it, PetscReal xnorm, PetscReal snorm, PetscReal fnorm, SNESConvergedReason* reason, void* self);
  /// SNES_DIVERGED_INNER: a length that was rejected before has taken more iterations than shorter steps, or that of an equilibrium makes no
  /// progress.
  PetscErrorCode judge(SNES snes, const Norms& at, SNESConvergedReason* reason);
  PetscErrorCode begin_solve(const ResidualNorms& now);
  SNESConvergedReason verdict(const Norms& at, const ResidualNorms& now) const;
  PetscErrorCode limit_evaluations(SNES snes, SNESConvergedReason* reason) const;
  PetscErrorCode confirm(SNES snes, const Norms& at, const ResidualNorms& now, SNESConvergedReason* reason);
  PetscErrorCode all_particles_converged(SNES snes, double rtol, bool* yes);
  PetscErrorCode set_forcing(SNES snes, PetscInt it, const ResidualNorms& now, double rtol) const;
  bool below(const ResidualNorms& now, double rtol, double floors) const;
  bool loads_grow() const;
  bool exhausted(const ResidualNorms& now, double rtol) const;
  bool has_fallen(const ResidualNorms& now, double part) const;
  bool in_vain(PetscInt iterations);
  double as_force(const ResidualNorms& norms) const { return std::max(solve_.inverse_h * norms[0], norms[1]); }

  NewtonSettings settings_;
  NewtonSolve solve_;
  ResidualNorms reference_ = {0, 0};  ///< residual where the step began, if Newton starts elsewhere (0: it does not)
  double floor_inverse_h_ = 0;        ///< 1/h the rounding errors were estimated for [1/s]
  std::int64_t at_floor_ = 0, uneven_ = 0, loose_ = 0;
  PastLengths lengths_;
  std::string gave_up_;
  int longest_idle_ = 0;
  bool all_iterations_ = false, to_rounding_ = false;
  bool descends_ = false;  ///< the search makes the potential fall, and no bound on the residual is given
};

}  // namespace bs
