// Pseudo-transient continuation: what Newton's method for an equilibrium does where it has failed.
#pragma once
#include <petscts.h>
#include <cstdint>
#include <vector>
#include "base/warnings.hpp"
#include "systems/equilibrium.hpp"
#include "time/ts_setup.hpp"

namespace bs {

/// A solve that has failed, of a load step that has been cut to a 60th of its length, is repeated from the last equilibrium by steps of
/// pseudo time h_k (one Newton correction of backward Euler each, at rest in between):
///   (M/h_k^2 - K) z = f,   1/h_k^2 = (mean squared frequency) |f_k|/|f_0|
/// with the energy search, which makes every step go downhill: it ends in a minimum of the energy, which may be far from the last one.
class PseudoTime {
 public:
  /// Collective. Once the options of `ts` are read; the arguments must outlive the solver.
  PetscErrorCode attach(TS ts, TSContext& context, Equilibrium& model, double nominal);
  /// Collective. Newton's method, and pseudo time where it fails, in the place of SNES's solve.
  PetscErrorCode solve(SNES snes);
  /// Collective, between two steps. From y, which is none, to the equilibrium of the same loads; y stays where that is not found.
  PetscErrorCode relax(Vec y, bool* good);
  /// Collective. A step of h [s] of the motion that the model is set to, from y; without fallback.
  PetscErrorCode advance(double h, Vec y, bool* good);
  /// Collective. Newton's method alone, without fallback; where is_newton().
  PetscErrorCode newton(SNES snes) const { return newton_(snes); }
  bool is_newton() const { return newton_ && !other_; }
  /// Whether the present solve is of a load step, neither what follows a break nor what goes before the first one.
  bool at_load_step() const { return !aside_; }
  std::int64_t solves() const { return solves_; }  ///< that ended in an equilibrium

 private:
  PetscErrorCode continue_from_start(SNES snes);
  PetscErrorCode solve_from(Vec y, bool* good);

  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  Equilibrium* model_ = nullptr;
  double nominal_ = 0;
  double tried_ = -1;  ///< load factor from which the last one started: none is repeated from the same state
  enum class Fallback { late, always, never } fallback_ = Fallback::late;  ///< late: of steps that have been cut
  bool other_ = false;  ///< the SNES is of another type than Newton's method with a line search: there is no fallback
  bool aside_ = false;  ///< within relax() or advance()
  VecHandle room_;
  PetscErrorCode (*newton_)(SNES) = nullptr;
  std::int64_t solves_ = 0;
};

// The start of a static analysis: the lattice as it was given need not be in equilibrium.

/// Before the first load step the lattice comes to rest under the loads of the load factor 0. What it gives up on the way is released, not work of
/// the loads, and load steps lead from equilibrium to equilibrium from the first one on. Where no such equilibrium is found the first step starts
/// from the lattice as it is given.
class RestStart {
 public:
  /// Collective. Before the first step of `ts`; its state becomes the equilibrium. The factor of `model` is 0 afterwards.
  PetscErrorCode find(TS ts, TSContext& context, Equilibrium& model, PseudoTime& solver);
  bool tried() const { return tried_; }
  bool found() const { return found_; }
  void count(std::vector<Tally>* out) const;
  PetscErrorCode warn(Warnings* warnings) const;
  void save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  bool tried_ = false, found_ = false;
  std::int64_t iterations_ = 0;  ///< of Newton's method
};

}  // namespace bs
