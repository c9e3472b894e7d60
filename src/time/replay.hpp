// Replay of known steps in a TS, to restore its history of earlier steps.
#pragma once
#include <petscts.h>
#include <vector>
#include "base/handle.hpp"

namespace bs {

class Replay {
 public:
  /// Collective. Keeps the state of `ts` and puts a solver in place of its own that takes answers from a list.
  PetscErrorCode begin(TS ts);
  /// The state `ts` had.
  Vec present() const { return present_; }
  /// Collective. The step of length h from (time, y) to `end`; `half`: what its starting procedure finds first, or null.
  PetscErrorCode step(double time, double h, Vec y, Vec half, Vec end);
  /// Collective. Everything as it was, but for the memory.
  PetscErrorCode end(double time, double h);

 private:
  static PetscErrorCode answer(SNES snes, Vec x);
  PetscErrorCode take_step(double time, double h, Vec y);
  TS ts_ = nullptr;
  SNESHandle own_, knowing_;
  VecHandle present_, residual_;
  std::vector<Vec> answers_;  ///< in the order they are asked for
  std::size_t asked_ = 0;
  PetscInt steps_ = 0;
};

}  // namespace bs
