// What the symmetric S leaves out of the condensed system (dampers along springs whose ends move across them): a flexible
// Krylov method on the exact S, preconditioned by the solver of the symmetric one.
#pragma once
#include <petscksp.h>
#include "base/handle.hpp"
#include "systems/tangent.hpp"

namespace bs {

class ExactCorrection {
 public:
  /// Collective. w, which `symmetric` has solved for, is improved until |b - S w| <= rtol |b| with the exact S, if it is
  /// not there already. iterations: those of `symmetric` that it took; reason: negative where it did not get there.
  PetscErrorCode apply(Tangent& tangent, KSP symmetric, double rtol, Vec b, Vec w, PetscInt* iterations, KSPConvergedReason* reason);

 private:
  PetscErrorCode create(Tangent& tangent, KSP symmetric, Vec b);
  KSPHandle ksp_;
  MatHandle exact_;
  VecHandle left_;
};

}  // namespace bs
