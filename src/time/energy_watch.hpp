// Detection of energy growth without a source: a step too long for its method, or inaccurate linear solves in Newton's method.
#pragma once
#include <string>
#include "base/error.hpp"
#include "systems/model.hpp"

namespace bs {

/// Kinetic and elastic energy may not be more than `factor` times what there was and what has come:
///   inner(t) <= factor (inner(0) + max (field(0) - field(s)) + sum of (power dt + pull |shift's path| + |work of driven groups|) + rounding),   s <=
///   t
/// power and pull are the larger of the two ends of every stretch between two checks, and are counted whatever their sign, so that the watch may warn
/// too late, but not too early. It checks the first 32 steps, then every 4th on average (explicit types: 8, and every 128th), irregularly, so that no
/// drive is in step with it, and every frame.
class EnergyWatch {
 public:
  /// `factor` 0: no check is made.
  EnergyWatch(Model& model, double factor, Warnings& warnings) : model_(model), warnings_(warnings), factor_(factor) {}
  void set_explicit();
  /// Every step is looked at: of systems whose sources may act for a few steps only.
  void check_every_step() { always_ = true; }
  /// Collective. After step `step` that ended at `t`; `certainly`: whether or not it is one to be looked at. Warns once.
  PetscErrorCode check(PetscInt step, double t, Vec y, bool certainly);
  /// What a checkpoint holds of it, and back, where it holds that.
  void save(Facts* facts) const;
  void restore(const Facts& facts);

 private:
  bool chosen(PetscInt step) const;
  static std::vector<std::pair<const char*, double*>> numbers(EnergyWatch* of);
  std::string words(double inner, double budget) const;

  Model& model_;
  Warnings& warnings_;
  double factor_;
  bool always_ = false, explicit_ = false, active_ = true, begun_ = false;
  double time_ = 0, supplied_ = 0, start_ = 0, released_ = 0, field_ = 0;
  EnergySupply last_;
};

}  // namespace bs
