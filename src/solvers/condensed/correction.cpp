#include "solvers/condensed/inner_solver.hpp"

namespace bs {
namespace {

PetscErrorCode multiply(Mat S, Vec w, Vec y) {
  Tangent* tangent = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(S, &tangent));
  PetscCall(tangent->multiply_condensed(w, y));
  PetscFunctionReturn(0);
}

/// z from r by the solver of the symmetric S.
PetscErrorCode precondition(PC pc, Vec r, Vec z) {
  KSP symmetric = nullptr;
  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &symmetric));
  PetscCall(KSPSolve(symmetric, r, z));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode ExactCorrection::create(Tangent& tangent, KSP symmetric, Vec b) {
  PetscInt local = 0;
  PC pc;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(b, &local));
  PetscCall(VecDuplicate(b, left_.out()));
  PetscCall(MatCreateShell(tangent.comm(), local, local, PETSC_DETERMINE, PETSC_DETERMINE, &tangent, exact_.out()));
  PetscCall(MatSetVecType(exact_, VECSTANDARD));
  PetscCall(MatShellSetOperation(exact_, MATOP_MULT, reinterpret_cast<void (*)()>(multiply)));
  PetscCall(KSPCreate(tangent.comm(), ksp_.out()));
  PetscCall(KSPSetType(ksp_, KSPFGMRES));
  PetscCall(KSPSetOperators(ksp_, exact_, exact_));
  PetscCall(KSPSetInitialGuessNonzero(ksp_, PETSC_TRUE));
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, symmetric));
  PetscCall(PCShellSetApply(pc, precondition));
  PetscFunctionReturn(0);
}

PetscErrorCode ExactCorrection::apply(Tangent& tangent, KSP symmetric, double rtol, Vec b, Vec w, PetscInt* iterations, KSPConvergedReason* reason) {
  constexpr PetscInt MOST = 100;
  PetscReal size = 0, left = 0;
  PetscInt before = 0, after = 0;
  PetscFunctionBegin;
  if (!ksp_) PetscCall(create(tangent, symmetric, b));
  *iterations = 0;
  *reason = KSP_CONVERGED_RTOL;
  PetscCall(tangent.multiply_condensed(w, left_));
  PetscCall(VecAYPX(left_, -1.0, b));
  PetscCall(VecNorm(b, NORM_2, &size));
  PetscCall(VecNorm(left_, NORM_2, &left));
  if (left <= rtol * size) PetscFunctionReturn(0);
  PetscCall(KSPGetTotalIterations(symmetric, &before));
  // measured against b, not against what the symmetric solve has left
  PetscCall(KSPSetTolerances(ksp_, 0.0, rtol * size, PETSC_DEFAULT, MOST));
  PetscCall(KSPSolve(ksp_, b, w));
  PetscCall(KSPGetConvergedReason(ksp_, reason));
  PetscCall(KSPGetTotalIterations(symmetric, &after));
  *iterations = after - before;
  PetscFunctionReturn(0);
}

}  // namespace bs
