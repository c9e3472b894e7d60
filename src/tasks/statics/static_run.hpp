// What statics adds to a run.
#pragma once
#include <cstdint>
#include <string>
#include <vector>
#include "systems/equilibrium.hpp"
#include "tasks/compliance.hpp"
#include "tasks/moduli.hpp"
#include "tasks/run.hpp"
#include "tasks/sensitivities.hpp"
#include "tasks/statics/arc_length.hpp"
#include "tasks/statics/avalanche.hpp"
#include "tasks/statics/box_stress.hpp"
#include "tasks/statics/pseudo_time.hpp"
#include "tasks/statics/rest_start.hpp"
#include "tasks/statics/snap_through.hpp"
#include "tasks/statics/stability.hpp"
#include "tasks/statics/statics.hpp"

namespace bs {

/// What is computed at the last equilibrium, where it is wanted.
struct FinalAnalyses {
  Compliance compliance;
  Moduli moduli;
  bool wanted() const { return compliance.wanted() || moduli.wanted(); }
};

/// What statics adds to a run: load steps for time steps, the fallback, and the signs of the tangent's pivots.
class StaticRun {
 public:
  StaticRun(Equilibrium& model, const StaticsSettings& options, FinalAnalyses* end)
      : model_(model), options_(options), end_(end), stability_(options.stability_iterations), avalanche_(model, pseudo_, options.avalanche) {}
  PetscErrorCode begin_box() { return box_.begin(model_, options_); }
  RunHooks hooks();
  /// Collective, after the run. From y, its last equilibrium, of load factor `factor`, to that of the system as it is now, with other numbers.
  /// `failure`: there is none, and y stays; empty: y is it.
  PetscErrorCode follow(double factor, Vec y, std::string* failure);
  /// Collective, after the run: find_adjoint() (tasks/sensitivities.hpp) at its last equilibrium.
  PetscErrorCode adjoint(double factor, Vec y, const std::vector<double>& slope, Vec lambda) {
    return find_adjoint(ts_, context_->matrix, model_, factor, y, slope, lambda);
  }

 private:
  PetscErrorCode attach(TS ts, TSContext& context, double step);
  PetscErrorCode begin();
  PetscErrorCode examine(double factor, Vec y, StageCheck* out);
  PetscErrorCode return_free_bodies(double factor, Vec y);
  PetscErrorCode observe(double factor, Vec y, std::vector<Observable>* out);
  PetscErrorCode count(std::vector<Tally>* out) const;
  PetscErrorCode find(double factor, Vec y, FinalResults* out);
  PetscErrorCode final_warnings(Warnings* warnings);

  Equilibrium& model_;
  StaticsSettings options_;
  FinalAnalyses* end_;  ///< null: nothing is wanted
  BoxStress box_;
  PseudoTime pseudo_;
  RestStart start_;
  ArcLength arc_;
  SnapThrough snaps_;
  Stability stability_;
  Avalanche avalanche_;
  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  std::int64_t turns_ = 0;  ///< times the load factor began to fall or to rise
  double last_factor_ = 0, last_way_ = 0;
};

}  // namespace bs
