// What the signs of the pivots of a factored S say of it: how many of its eigenvalues are negative, and whether a direction may be taken from it.
#include "linalg/condensed/condensed.hpp"
#include "linalg/condensed/inner_solver.hpp"
#include "linalg/solver_options.hpp"

namespace bs {

/// Of a factored S; -1 and false where the factors do not tell. A pivot of 0 counts for `has`.
PetscErrorCode InnerSolver::count_negative_pivots(PetscInt* count, bool* has) {
  PC outer, pc;
  PetscBool cholesky = PETSC_FALSE;
  PCFailedReason failed = PC_NOERROR;
  Mat factors = nullptr;
  PetscInt negative = 0, zero = 0, positive = 0;
  PetscFunctionBegin;
  *has = false;
  *count = -1;
  PetscCall(KSPGetPC(ksp_, &outer));
  PetscCall(factoring_pc(outer, &pc));
  if (pc != outer) PetscCall(PCSetUp(pc));  // which PCREDUNDANT puts off to its first solve since 3.25
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCCHOLESKY, &cholesky));
  PetscCall(PCGetFailedReason(pc, &failed));
  if (!cholesky || failed != PC_NOERROR) {
    *has = cholesky && failed != PC_NOERROR;
    PetscFunctionReturn(0);
  }
  PetscCall(PCFactorGetMatrix(pc, &factors));
  PetscCall(MatGetInertia(factors, &negative, &zero, &positive));
  *count = negative;
  *has = negative + zero > 0;
  positive_factors_ = !*has;
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::negative_pivots(PetscInt* count) {
  bool has = false;
  PetscFunctionBegin;
  *count = -1;
  if (!direct_) PetscFunctionReturn(0);
  absolute_in_force_ = false;
  lifted_ = true;
  PetscCall(linearise(false));
  lifted_ = false;
  PetscCall(count_negative_pivots(count, &has));
  PetscFunctionReturn(0);
}

// S + D with D >= 0 has no more negative eigenvalues than S: what is negative still is so beyond doubt.
PetscErrorCode InnerSolver::lift_diagonal() {
  VecHandle doubt;
  PetscFunctionBegin;
  PetscCall(create_vector(doubt.out()));
  PetscCall(tangent_->stiffness_sizes(doubt));
  PetscCall(VecScale(doubt, CURVATURE_DOUBT));
  PetscCall(MatDiagonalSet(S_, doubt, ADD_VALUES));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::negative_direction(Vec b, PetscInt most, Vec w, bool* found) {
  PC pc;
  PetscFunctionBegin;
  *found = false;
  if (direct_) PetscFunctionReturn(0);
  renew();
  PetscCall(linearise(false));
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(find_negative_curvature(S_, pc, b, most, w, found));
  renew();
  PetscFunctionReturn(0);
}

/// Of S as a direction is taken from it; where S itself has to be solved with, its signs do not matter.
PetscErrorCode InnerSolver::look_at_pivots(CondensedCounts* counts) {
  PetscInt count = 0;
  PetscFunctionBegin;
  indefinite_ = false;
  if (!direct_ || kept_ || !demand_.direction || definite_ || absolute_in_force_) PetscFunctionReturn(0);
  PetscCall(count_negative_pivots(&count, &indefinite_));
  if (indefinite_) ++counts->indefinite;
  PetscFunctionReturn(0);
}

}  // namespace bs
