// Pseudo-transient continuation: what Newton's method for an equilibrium does where it has failed, or found a saddle point.
#pragma once
#include <petscts.h>
#include <cstdint>
#include <vector>
#include "base/error.hpp"
#include "base/facts.hpp"
#include "systems/equilibrium.hpp"
#include "time/ts_setup.hpp"

namespace bs {

/// Whether a solve ended by its own test, not by one that options have taken its place with (-snes_atol, -snes_type ksponly and the like).
inline bool ended_by_itself(SNESConvergedReason reason) { return reason == SNES_CONVERGED_FNORM_RELATIVE || reason == SNES_CONVERGED_SNORM_RELATIVE; }

/// A solve that has failed is repeated from the last equilibrium by steps of backward Euler in a pseudo time, from rest each:
///   M (x - x_n)/h^2 = f(x)
/// which is where E + |x - x_n|_M^2/(2 h^2) is stationary: every step goes downhill, and they end in a minimum of the energy, which may be far from
/// the last one. Newton's method for a step predicts tensions (Linearisation::predict_tensions), so that linkages that turn take long steps.
class PseudoTime {
 public:
  /// Equilibria are to be minima of the energy: those that turn out unstable are left along an unstable direction, found by at most so many
  /// iterations where the linear solver is iterative.
  void demand_minima(PetscInt iterations) {
    minima_ = true;
    iterations_ = iterations;
  }
  /// Collective. Once the options of `ts` are read; the arguments must outlive the solver.
  PetscErrorCode attach(TS ts, TSContext& context, Equilibrium& model, double nominal);
  /// Collective. Newton's method, and pseudo time where it fails, in the place of SNES's solve.
  PetscErrorCode solve(SNES snes);
  /// Collective, between two steps. From y, which is none, to the equilibrium of the same loads; y stays where that is not found.
  PetscErrorCode relax(Vec y, bool* good) { return solve_from(y, Fallback::always, good); }
  /// Collective. A step of h [s] of the motion that the model is set to, from y; without fallback.
  PetscErrorCode advance(double h, Vec y, bool* good);
  /// Collective. Newton's method alone, without fallback; where is_newton().
  PetscErrorCode newton(SNES snes) const { return newton_(snes); }
  bool is_newton() const { return newton_ && !other_; }
  /// Whether the present solve is of a load step, neither what follows a break nor what goes before the first one.
  bool at_load_step() const { return !between_load_steps_; }
  /// The time whose loads the present solve is under.
  PetscErrorCode time_of_loads(double* t);
  /// Collective. Whether y at the time t is the minimum that the last solve ended in, of which leave_saddles() knows the negative pivots (-1: not
  /// counted) and that it found no unstable direction.
  PetscErrorCode is_found_minimum(double t, Vec y, PetscInt* negative, bool* yes) const;
  std::int64_t solves() const { return solves_; }  ///< that ended in an equilibrium
  /// Whether the present solve went by pseudo time, from the last equilibrium or from a saddle point.
  bool continued() const { return continued_; }
  void count(std::vector<Tally>* out) const;
  void save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  enum class Fallback { late, always, never };  ///< late: of steps that have been cut
  PetscErrorCode make_room(Vec y);
  PetscErrorCode continue_from(SNES snes);
  PetscErrorCode leave_saddles(SNES snes);
  PetscErrorCode balance_better(SNES snes);
  PetscErrorCode continue_further(SNES snes, bool* good);
  PetscErrorCode solve_to_rounding(SNES snes);
  PetscErrorCode solve_from(Vec y, Fallback fallback, bool* good);
  PetscErrorCode linear_solve(SNES snes, Vec X, Vec z, bool* good, bool* definite);
  PetscErrorCode step(SNES snes, double h, Vec start, Vec X, PetscInt* corrections, bool* good);
  PetscErrorCode falls(Vec start, Vec X, bool* yes);
  PetscErrorCode descend(SNES snes, double goal, Vec at, Vec X);

  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  Equilibrium* model_ = nullptr;
  double nominal_ = 0;
  double tried_ = -1;  ///< load factor from which the last one started: none is repeated from the same state
  Fallback fallback_ = Fallback::late;
  bool other_ = false;               ///< the SNES is of another type than Newton's method with a line search: there is no fallback
  bool between_load_steps_ = false;  ///< within relax() or advance()
  bool minima_ = false, continued_ = false;
  PetscInt iterations_ = 0;
  VecHandle room_, at_, correction_, saddle_, direction_;
  struct {
    VecHandle at;  ///< null: none is known
    double time = 0;
    PetscInt negative = 0;
  } minimum_;         ///< that the last solve ended in
  double shift_ = 0;  ///< 1/h^2 by the mean squared frequency
  PetscInt newton_steps_ = 0, krylov_ = 0;
  PetscErrorCode (*newton_)(SNES) = nullptr;
  std::int64_t solves_ = 0, saddles_ = 0;  ///< the second: solves that left saddle points
};

}  // namespace bs
