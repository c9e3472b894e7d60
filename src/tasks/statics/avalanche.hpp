// What follows a break in statics: from equilibrium to equilibrium at constant load, or in motion until it has come to rest.
#pragma once
#include <functional>
#include <string>
#include "systems/equilibrium.hpp"
#include "systems/system.hpp"
#include "tasks/statics/pseudo_time.hpp"

namespace bs {

struct AvalancheOptions {
  bool dynamics = false;       ///< -bs_break_follow
  double step = 0;             ///< -bs_break_dt [s]; 0: one over the root mean squared frequency
  std::int64_t most = 100000;  ///< -bs_break_max_steps
  double interval = 0;         ///< -bs_break_output_interval [s]; 0: no frames of the motion
};

class Avalanche {
 public:
  using Frame = std::function<PetscErrorCode(Vec)>;
  Avalanche(Equilibrium& model, PseudoTime& solver, const AvalancheOptions& options) : model_(model), solver_(solver), options_(options) {}
  /// Whether what is observed is a frame of the motion, not an equilibrium.
  bool moving() const { return moving_; }
  /// Collective, after the system broke at the equilibrium y of that factor. y becomes one at which nothing breaks (`found`); or `failure` says why
  /// there is none; or a signal ends the run in between, with nothing in `failure`.
  PetscErrorCode follow_to_rest(double factor, Vec y, const Frame& frame, bool* found, std::string* failure);
  /// Collective. From y to the equilibrium of that factor; then what is past its limits there breaks. y stays where there is none.
  PetscErrorCode relax(double factor, Vec y, bool* good);

 private:
  /// `broken`: what breaks in the motion is added to it.
  PetscErrorCode follow(double factor, Vec y, const Frame& frame, std::int64_t* broken, bool* good);
  PetscErrorCode move(double factor, double h, Vec y, HeldEnergies* now, bool* good);
  PetscErrorCode check_for_signal();

  Equilibrium& model_;
  PseudoTime& solver_;
  AvalancheOptions options_;
  bool moving_ = false;
  bool interrupted_ = false;  ///< by a signal that ends the run
};

}  // namespace bs
