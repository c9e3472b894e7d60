// The stability limit of explicit steps, watched while the system changes.
#pragma once
#include <petscts.h>
#include "base/warnings.hpp"
#include "tasks/adviser.hpp"

namespace bs {

/// Springs that stiffen, or meet, make steps unstable that were stable at the start. After steps 1, 2, 4, ... 512 and every 512th, the fastest
/// oscillation is estimated anew, by at most 15 evaluations of the forces; from below, so that nothing is said of a step that is stable.
class StepWatch {
 public:
  StepWatch(Model& model, Warnings& warnings) : model_(model), warnings_(warnings) {}
  /// Watches explicit types whose fixed steps are stable at the start, by what was found there, on mechanical systems; nothing else.
  PetscErrorCode begin(TS ts, const TSContext& context, const Advice& start);
  /// Collective. After a step; warns once.
  PetscErrorCode look(PetscInt step, double t, Vec y);

 private:
  Model& model_;
  Warnings& warnings_;
  const Method* method_ = nullptr;  ///< null: not watched
  double step_ = 0;                 ///< nominal [s]
};

}  // namespace bs
