// What the inner solver does where S is not positive definite (directions by absolute curvatures, or the solution of S w = b), or not all of the
// exact S.
#include <algorithm>
#include <cmath>
#include "base/handle.hpp"
#include "base/petsc_versions.hpp"
#include "linalg/condensed/inner_solver.hpp"

namespace bs {

// What is factored is always S_, of which solvers keep the pattern and their settings. For directions by absolute curvatures it holds the
// definite part, as old as the factors, and exact_ holds S.
PetscErrorCode InnerSolver::assemble_matrices(bool definite, Mat* multiplied) {
  PetscFunctionBegin;
  *multiplied = S_;
  if (!absolute_in_force_ || definite) {
    PetscCall(tangent_->assemble(definite, S_));
    PetscFunctionReturn(0);
  }
  if (!exact_) PetscCall(tangent_->create(storage_, exact_.out()));
  PetscCall(tangent_->assemble(false, exact_));
  if (fresh_) PetscCall(tangent_->assemble(true, S_));
  *multiplied = exact_;
  PetscFunctionReturn(0);
}

/// From a solve with S that has met negative curvature on: by absolute curvatures, with factors of the definite part.
PetscErrorCode InnerSolver::start_absolute(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  PetscFunctionBegin;
  absolute_in_force_ = true;
  renew_factors();
  PetscCall(linearise(false));
  ++counts->refreshed;
  --counts->indefinite;  // it is counted by what follows
  PetscCall(solve_absolute(b, w, counts, reason));
  PetscFunctionReturn(0);
}

// Far from the minimum a direction need not be better than LOOSE; near it S is positive definite, and Newton's tolerance holds.
PetscErrorCode InnerSolver::solve_absolute(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  constexpr double LOOSE = 0.1;
  AbsoluteSolve::Outcome outcome;
  AbsoluteSolve::Demand demand;
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  demand.rtol = rtol_;
  demand.loose = std::max(rtol_, LOOSE);
  PetscCall(KSPGetTolerances(ksp_, nullptr, nullptr, nullptr, &demand.most));
  PetscCall(absolute_.solve(exact_, pc, b, w, demand, &outcome));
  counts->iterations += outcome.iterations;
  if (outcome.negative) ++counts->indefinite;
  indefinite_ = outcome.negative;
  *reason = KSP_CONVERGED_RTOL;
  if (!outcome.sound) PetscCall(take_definite(b, w, counts, reason));
  PetscFunctionReturn(0);
}

/// The direction of the definite part of S.
PetscErrorCode InnerSolver::take_definite(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  PetscFunctionBegin;
  absolute_in_force_ = false;
  PetscCall(linearise(true));
  ++counts->refreshed;
  PetscCall(run(ksp_, b, w, counts, reason));
  PetscFunctionReturn(0);
}

// Where S itself has to be solved with and is not positive definite (springs under compression, large steps), MINRES on S
// with the preconditioner of its definite part.
PetscErrorCode InnerSolver::solve_indefinite(Vec b, Vec w, CondensedCounts* counts, bool* solved) {
  KSPConvergedReason reason;
  PetscFunctionBegin;
  if (!fallback_) {
    PC own, pc;
    PCType type;
    PetscCall(tangent_->create(storage_, positive_.out()));
    PetscCall(KSPCreate(tangent_->comm(), fallback_.out()));
    PetscCall(KSPSetOptionsPrefix(fallback_, (prefix_ + "fallback_").c_str()));
    PetscCall(KSPSetType(fallback_, KSPMINRES));
    PetscCall(KSPSetTolerances(fallback_, rtol_, 0.0, 1e8, 4000));
    PetscCall(KSPGetPC(ksp_, &own));
    PetscCall(PCGetType(own, &type));
    PetscCall(KSPGetPC(fallback_, &pc));
    PetscCall(PCSetType(pc, type));
    PetscCall(KSPSetFromOptions(fallback_));
    PetscCall(keep_parts(pc, KeptParts::none));  // a run and its continuation then agree
  }
  PetscCall(tangent_->assemble(true, positive_));
  PetscCall(KSPSetOperators(fallback_, S_, positive_));
  PetscCall(run(fallback_, b, w, counts, &reason));
  *solved = reason > 0;
  PetscFunctionReturn(0);
}

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
  PetscCall(set_shell_operation(exact_, MATOP_MULT, multiply));
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
