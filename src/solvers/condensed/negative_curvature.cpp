#include "solvers/condensed/negative_curvature.hpp"
#include <cmath>
#include "base/handle.hpp"

namespace bs {

// p <- P^-1 r + (r.P^-1 r)/(r.P^-1 r)_before p;  r <- r - (r.P^-1 r)/(p.S p) S p
PetscErrorCode find_negative_curvature(Mat S, PC P, Vec b, PetscInt most, Vec w, bool* found) {
  constexpr double EXHAUSTED = 1e-24;  // of the first r.P^-1 r: the Krylov space ends
  VecHandle r, z, Sp;
  PetscScalar rz = 0, before = 0, first = 0, curvature = 0;
  PetscFunctionBegin;
  *found = false;
  for (VecHandle* room : {&r, &z, &Sp}) PetscCall(VecDuplicate(b, room->out()));
  PetscCall(VecCopy(b, r));
  PetscCall(VecZeroEntries(w));
  for (PetscInt k = 0; k < most; ++k) {
    PetscCall(PCApply(P, r, z));
    PetscCall(VecDot(r, z, &rz));
    if (k == 0) first = rz;
    if (!(rz > EXHAUSTED * first) || !std::isfinite(rz)) PetscFunctionReturn(0);
    PetscCall(VecAYPX(w, k == 0 ? 0.0 : rz / before, z));
    PetscCall(MatMult(S, w, Sp));
    PetscCall(VecDot(w, Sp, &curvature));
    if (!std::isfinite(curvature)) PetscFunctionReturn(0);
    *found = !(curvature > 0);
    if (*found) PetscFunctionReturn(0);
    PetscCall(VecAXPY(r, -rz / curvature, Sp));
    before = rz;
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
