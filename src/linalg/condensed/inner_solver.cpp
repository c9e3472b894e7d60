#include "linalg/condensed/inner_solver.hpp"
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "base/factor_memory.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/solver_options.hpp"

namespace bs {

void InnerSolver::renew() {
  renew_factors();
  age_.forget();
  factors_wanted_ = false;  // a run that begins here has not measured anything
  indefinite_ = absolute_in_force_ = false;
}

// Multigrid is built upon the rigid modes of the state it is built at: a body that has turned by a right angle has other rotations.
// GAMG keeps its interpolation for life; only a new PC makes a new one.
PetscErrorCode InnerSolver::build_hierarchy() {
  PC old;
  PCHandle fresh;
  PetscBool gamg = PETSC_FALSE;
  PetscFunctionBegin;
  rebuild_ = false;
  PetscCall(tangent_->set_rigid_modes(S_));
  PetscCall(KSPGetPC(ksp_, &old));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(old), PCGAMG, &gamg));
  if (!gamg || !built_) {
    built_ = true;
    PetscFunctionReturn(0);
  }
  PetscCall(PCCreate(tangent_->comm(), fresh.out()));
  PetscCall(PCSetOptionsPrefix(fresh, prefix_.c_str()));
  PetscCall(PCSetType(fresh, PCGAMG));
  PetscCall(PCSetOperators(fresh, S_, S_));
  PetscCall(PCSetFromOptions(fresh));
  PetscCall(KSPSetPC(ksp_, fresh));
  PetscFunctionReturn(0);
}

/// Of the last preconditioner, in the next set-up of one that can keep some.
PetscErrorCode InnerSolver::keep_parts(PC pc, KeptParts parts) const {
  PetscErrorCode (*function)(PC, KeptParts) = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscObjectQueryFunction(reinterpret_cast<PetscObject>(pc), "BSKeepParts_C", &function));
  if (function) PetscCall(function(pc, parts));
  PetscFunctionReturn(0);
}

// A direct solver wants the matrix as it is; a Krylov method works with an old preconditioner until it costs more iterations
// than a new one would.
PetscErrorCode InnerSolver::linearise(bool definite) {
  PetscFunctionBegin;
  if (factors_wanted_ != measured_) PetscCall(change_solver(factors_wanted_));
  kept_ = reuse_ && positive_factors_ && demand_.direction && !definite && !lifted_ && !absolute_in_force_ && tangent_->exact_symmetric();
  if (kept_) {
    fresh_ = definite_ = false;
    if (!exact_) PetscCall(tangent_->create(storage_, exact_.out()));
    PetscCall(tangent_->assemble(false, exact_));
    PetscFunctionReturn(0);
  }
  positive_factors_ = false;
  const double sigma = tangent_->sigma();
  if (definite != definite_ || direct_ || refresh_ <= 0 || std::abs(sigma - sigma_) > 0.1 * sigma_) age_.discard();
  definite_ = definite;
  fresh_ = age_.due();
  const KeptParts kept = fresh_ ? age_.renew() : KeptParts::coarse_space;
  if (fresh_) sigma_ = sigma;
  Mat multiplied = nullptr;
  PetscCall(assemble_matrices(definite, &multiplied));
  if (lifted_) PetscCall(lift_diagonal());
  if (fresh_ && rebuild_ && storage_ == CondensedStorage::aij && !direct_) PetscCall(build_hierarchy());
  PetscCall(KSPSetOperators(ksp_, multiplied, S_));
  PetscCall(KSPSetReusePreconditioner(ksp_, fresh_ ? PETSC_FALSE : PETSC_TRUE));
  PC pc, factors;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(keep_parts(pc, kept));
  PetscCall(factoring_pc(pc, &factors));
  PetscCall(make_pivots_relative(factors, false));
  PetscCall(set_up_solver(ksp_));
  PetscCall(make_pivots_relative(factors, true));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::assemble(CondensedCounts* counts) {
  PetscFunctionBegin;
  PetscCall(linearise(demand_.direction && demand_.curvature == Curvature::definite));
  PetscCall(look_at_pivots(counts));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::set_up_on_blocks() {
  PetscFunctionBegin;
  PetscCall(KSPSetUpOnBlocks(ksp_));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::run(KSP ksp, Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  PetscInt its = 0;
  PetscLogDouble before = 0, after = 0;
  PetscFunctionBegin;
  if (!own_rtol_) PetscCall(KSPSetTolerances(ksp, rtol_, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(PetscGetFlops(&before));
  PetscCall(KSPSolve(ksp, b, w));
  PetscCall(PetscGetFlops(&after));
  work_ = after - before;
  PetscCall(KSPGetConvergedReason(ksp, reason));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  counts->iterations += its;
  PetscFunctionReturn(0);
}

/// b.w > 0: w is a descent direction, since b is the negative gradient.
PetscErrorCode InnerSolver::leads_downhill(Vec b, Vec w, bool* yes) const {
  PetscScalar product = 0;
  PetscFunctionBegin;
  PetscCall(VecDot(b, w, &product));
  *yes = product > 0;
  PetscFunctionReturn(0);
}

// What S has nothing to do with: the iterations ran out before the factors, which may have aged, were good enough. The iterate is kept and
// gone on from with new ones, or S is factored.
PetscErrorCode InnerSolver::go_on(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  PetscFunctionBegin;
  renew_factors();
  PetscCall(linearise(definite_));
  ++counts->refreshed;
  PetscCall(KSPSetInitialGuessNonzero(ksp_, direct_ ? PETSC_FALSE : PETSC_TRUE));
  PetscCall(run(ksp_, b, w, counts, reason));
  PetscCall(KSPSetInitialGuessNonzero(ksp_, PETSC_FALSE));
  PetscFunctionReturn(0);
}

// Where few springs have changed, or all a little, iterations with the factors that were there cost less than new ones: a factorisation takes the
// time of ten to twenty solves with it. Nearly as exact as new factors would be, so that Newton's method converges as with them.
PetscErrorCode InnerSolver::solve_by_kept(Vec b, Vec w, CondensedCounts* counts, bool* solved) {
  constexpr PetscInt MOST = 12;
  constexpr double RTOL = 1e-6;
  AbsoluteSolve::Outcome outcome;
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(absolute_.solve(exact_, pc, b, w, {RTOL, RTOL, MOST}, &outcome));
  counts->iterations += outcome.iterations;
  *solved = outcome.sound && !outcome.negative && outcome.iterations < MOST;
  if (*solved) PetscFunctionReturn(0);
  reuse_ = false;
  PetscCall(linearise(false));
  PetscCall(look_at_pivots(counts));
  PetscFunctionReturn(0);
}

/// What becomes of a solve that ended for `reason`, by the reason.
PetscErrorCode InnerSolver::conclude(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason reason, bool* solved) {
  PetscFunctionBegin;
  *solved = reason > 0;
  failed_ = reason;
  if (reason == KSP_DIVERGED_ITS && demand_.direction) {
    PetscCall(leads_downhill(b, w, solved));
    if (*solved) ++counts->unfinished;
  } else if (reason < 0 && reason != KSP_DIVERGED_ITS && !direct_ && !demand_.direction) {
    if (reason == KSP_DIVERGED_INDEFINITE_MAT) ++counts->indefinite;
    PetscCall(solve_indefinite(b, w, counts, solved));
  }
  if (*solved) failed_ = KSP_CONVERGED_ITERATING;
  else if (failed_ == KSP_DIVERGED_ITS) ++counts->exhausted;
  else if (failed_ != KSP_DIVERGED_INDEFINITE_MAT) ++counts->broken;
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::solve(Vec b, Vec w, CondensedCounts* counts, bool* solved) {
  KSPConvergedReason reason;
  PetscInt before = counts->iterations;
  PetscFunctionBegin;
  ++counts->solves;
  const bool aged = !fresh_;
  PetscCall(solve_definite(b, w, counts, &reason));
  if (reason == KSP_DIVERGED_ITS && !demand_.direction) {
    PetscCall(compare_with_factors(counts->iterations - before));
    if (aged || factors_wanted_) PetscCall(go_on(b, w, counts, &reason));
  }
  const bool finished = reason > 0;
  PetscCall(conclude(b, w, counts, reason, solved));
  if (definite_) ++counts->definite;
  if (*solved && !definite_ && !absolute_in_force_ && !tangent_->exact_symmetric()) {
    PetscInt its = 0;
    PetscCall(correction_.apply(*tangent_, ksp_, rtol_, b, w, &its, &reason));
    counts->iterations += its;
    before += its;
    if (reason < 0 && !demand_.direction) *solved = false;
  }
  const double rate = static_cast<double>(counts->iterations - before) / std::max(1.0, -std::log10(rtol_));
  age_.note(rate, fresh_, refresh_);
  if (!finished) age_.discard();
  rebuild_ = rebuild_ || age_.due();
  fresh_ = false;
  if (!aged && !absolute_in_force_ && !indefinite_) PetscCall(compare_with_factors(counts->iterations - before));
  PetscFunctionReturn(0);
}

// A direct solver solves with an indefinite S as well, and what it gives may be a descent direction all the same, which
// leads to the nearest root in fewer iterations than any other: a symmetric lattice under pressure stays symmetric.
// Conjugate gradients stop at negative curvature. Where Newton's own direction leads uphill or cannot be had, and a direction is
// all that is asked for, curvatures count by their absolute values; where the solver breaks down, the definite part of S takes the place of S.
PetscErrorCode InnerSolver::solve_definite(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  bool downhill = true, solved = false;
  PetscFunctionBegin;
  if (kept_) PetscCall(solve_by_kept(b, w, counts, &solved));
  if (solved) {
    *reason = KSP_CONVERGED_RTOL;
    PetscFunctionReturn(0);
  }
  if (fresh_) ++counts->refreshed;
  if (absolute_in_force_ && !definite_) {
    PetscCall(solve_absolute(b, w, counts, reason));
    PetscFunctionReturn(0);
  }
  PetscCall(run(ksp_, b, w, counts, reason));
  if (definite_ || !demand_.direction || (direct_ && !indefinite_)) PetscFunctionReturn(0);
  if (*reason > 0) PetscCall(leads_downhill(b, w, &downhill));
  indefinite_ = !downhill || *reason == KSP_DIVERGED_INDEFINITE_MAT;
  const bool broken = *reason < 0 && *reason != KSP_DIVERGED_ITS && !indefinite_;
  if (!indefinite_ && !broken) PetscFunctionReturn(0);
  if (indefinite_ && !direct_) ++counts->indefinite;
  if (!by_absolute()) PetscFunctionReturn(0);
  if (broken) {
    ++counts->broken;
    PetscCall(take_definite(b, w, counts, reason));
  } else {
    PetscCall(start_absolute(b, w, counts, reason));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
