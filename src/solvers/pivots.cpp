#include "solvers/pivots.hpp"
#include <petscksp.h>
#include <limits>

namespace bs {

PetscErrorCode has_blocks(PC pc, bool* yes) {
  PetscBool found = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &found, PCBJACOBI, PCASM, ""));
  *yes = found;
  PetscFunctionReturn(0);
}

PetscErrorCode make_pivots_relative(PC pc, bool set_up) {
  PetscBool factors = PETSC_FALSE, given = PETSC_FALSE, jacobi = PETSC_FALSE;
  const char* prefix = nullptr;
  bool blocks = false;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(pc), &factors, PCLU, PCILU, PCCHOLESKY, ""));
  if (factors) {
    MatFactorShiftType shift;
    PetscCall(PCGetOptionsPrefix(pc, &prefix));
    PetscCall(PetscOptionsHasName(nullptr, prefix, "-pc_factor_zeropivot", &given));
    PetscCall(PCFactorGetShiftType(pc, &shift));
    // the other shifts compare a pivot with its row
    const bool absolute = shift == MAT_SHIFT_NONE || shift == MAT_SHIFT_INBLOCKS;
    if (!given && absolute) PetscCall(PCFactorSetZeroPivot(pc, std::numeric_limits<PetscReal>::min()));
  }
  PetscCall(has_blocks(pc, &blocks));
  if (!blocks || !set_up) PetscFunctionReturn(0);
  PetscInt count = 0;
  KSP* inner = nullptr;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCBJACOBI, &jacobi));
  if (jacobi) PetscCall(PCBJacobiGetSubKSP(pc, &count, nullptr, &inner));
  else PetscCall(PCASMGetSubKSP(pc, &count, nullptr, &inner));
  for (PetscInt k = 0; k < count; ++k) {
    PC own;
    PetscCall(KSPGetPC(inner[k], &own));
    PetscCall(make_pivots_relative(own, false));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
