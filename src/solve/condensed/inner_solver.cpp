#include "solve/condensed/inner_solver.hpp"
#include <algorithm>
#include <cmath>
#include "base/fault.hpp"
#include "model/particles/condensed/block_icc.hpp"
#include "solve/condensed/condensed.hpp"
#include "solve/pivots.hpp"

namespace bs {

PetscErrorCode InnerSolver::create(Tangent& tangent, const CondensedDemand& demand, const char* outer_prefix) {
  PetscReal refresh = refresh_;
  PetscBool given = PETSC_FALSE;
  PetscFunctionBegin;
  tangent_ = &tangent;
  demand_ = demand;
  prefix_ = std::string(outer_prefix ? outer_prefix : "") + "condensed_";
  const char* const names[] = {"springs", "sbaij", "baij", "aij"};
  PetscInt chosen = -1;
  PetscOptionsBegin(tangent.comm(), prefix_.c_str(), "Condensed solve of S w = b, S = sigma M - D - K/sigma", "PC");
  PetscCall(PetscOptionsReal("-refresh", "renew the preconditioner when a solve takes this many times the iterations per digit of "
                             "a new one; 0: always [1]", "", refresh, &refresh, nullptr));
  PetscCall(PetscOptionsEList("-mat_type", "how S is kept: springs (single precision, own kernels) or a PETSc matrix; the default "
                              "follows -condensed_pc_type", "", names, 4, "springs", &chosen, &given));
  PetscOptionsEnd();
  if (given) own_storage_ = static_cast<int>(chosen);
  refresh_ = refresh;
  PetscCall(PetscOptionsHasName(nullptr, prefix_.c_str(), "-ksp_rtol", &given));
  own_rtol_ = given;
  PetscCall(choose_storage());
  PetscFunctionReturn(0);
}

/// Type names first, since the storage of S depends on them; then S, then every other option.
PetscErrorCode InnerSolver::choose_storage() {
  char type[64] = "";
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPCreate(tangent_->comm(), ksp_.out()));
  PetscCall(KSPSetOptionsPrefix(ksp_, prefix_.c_str()));
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(PetscOptionsGetString(nullptr, prefix_.c_str(), "-pc_type", type, sizeof type, nullptr));
  const std::string own = type;
  direct_ = own.empty() ? tangent_->unknowns() <= DIRECT_UNKNOWNS : own == PCLU || own == PCCHOLESKY;
  const bool springs = own.empty() ? !direct_ : own == "bicc" || own == PCJACOBI || own == PCNONE;
  storage_ = springs ? CondensedStorage::springs : own == PCICC ? CondensedStorage::sbaij : CondensedStorage::aij;
  if (own_storage_ >= 0) storage_ = static_cast<CondensedStorage>(own_storage_);
  PetscCall(tangent_->create(storage_, S_.out()));
  PetscCall(MatSetOptionsPrefix(S_, prefix_.c_str()));
  PetscCall(KSPSetOperators(ksp_, S_, S_));
  PetscCall(set_defaults());
  PetscCall(KSPSetFromOptions(ksp_));
  PetscBool preonly = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ksp_.get()), KSPPREONLY, &preonly));
  direct_ = preonly;
  PetscCall(ask_for_inertia());
  PetscFunctionReturn(0);
}

/// MUMPS counts negative pivots only where it looks for null pivots, too, and keeps its last front on one rank.
PetscErrorCode InnerSolver::ask_for_inertia() {
  PC pc;
  PCType type = nullptr;
  MatSolverType solver = nullptr;
  Mat factors = nullptr;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(PCGetType(pc, &type));
  if (std::string(type) != PCCHOLESKY || !demand_.direction) PetscFunctionReturn(0);
  PetscCall(PCFactorGetMatSolverType(pc, &solver));
  if (!solver || std::string(solver) != MATSOLVERMUMPS) PetscFunctionReturn(0);
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &factors));
  PetscCall(MatMumpsSetIcntl(factors, 24, 1));
  PetscCall(MatMumpsSetIcntl(factors, 13, 1));
  PetscFunctionReturn(0);
}

// S is symmetric: Cholesky takes half the work of LU, and the signs of its pivots tell whether S is positive definite. PETSc's
// own is quick to start and good enough for small matrices, MUMPS for larger ones and on several ranks.
PetscErrorCode InnerSolver::set_direct(PC pc, PetscMPIInt ranks) {
  constexpr PetscInt SMALL = 1000;
  PetscFunctionBegin;
  PetscCall(KSPSetType(ksp_, KSPPREONLY));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  if (ranks > 1 || tangent_->unknowns() > SMALL) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  else PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGND));
  PetscCall(PCFactorSetZeroPivot(pc, PETSC_MACHINE_EPSILON * PETSC_MACHINE_EPSILON));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::set_defaults() {
  PC pc;
  PetscMPIInt ranks;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCallMPI(MPI_Comm_size(tangent_->comm(), &ranks));
  if (direct_ && storage_ == CondensedStorage::aij) {
    PetscCall(set_direct(pc, ranks));
    PetscFunctionReturn(0);
  }
  PetscCall(KSPSetType(ksp_, KSPCG));
  // the residual Newton asked to shrink; some methods know another one only
  char own[64] = KSPCG;
  PetscCall(PetscOptionsGetString(nullptr, prefix_.c_str(), "-ksp_type", own, sizeof own, nullptr));
  if (std::string(own) == KSPCG) PetscCall(KSPSetNormType(ksp_, KSP_NORM_UNPRECONDITIONED));
  PetscCall(KSPSetTolerances(ksp_, rtol_, 0.0, 1e8, 2000));
  PetscCall(PCSetType(pc, storage_ == CondensedStorage::springs ? "bicc" : PCBJACOBI));
  if (storage_ == CondensedStorage::sbaij) PetscCall(PCSetType(pc, ranks > 1 ? PCBJACOBI : PCICC));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::create_vector(Vec* out) const {
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(S_, out, nullptr));
  PetscFunctionReturn(0);
}

void InnerSolver::renew() {
  stale_ = true;
  indefinite_ = false;
  hope_ = true;
}

// A direct solver wants the matrix as it is; a Krylov method works with an old preconditioner until it costs more iterations
// than a new one would.
PetscErrorCode InnerSolver::linearise(bool definite) {
  PetscFunctionBegin;
  if (definite != definite_) stale_ = true;
  definite_ = definite;
  PetscCall(tangent_->assemble(definite, S_));
  const double sigma = tangent_->sigma();
  fresh_ = direct_ || refresh_ <= 0 || stale_ || std::abs(sigma - sigma_) > 0.1 * sigma_;
  if (fresh_) sigma_ = sigma;
  stale_ = false;
  PetscCall(KSPSetOperators(ksp_, S_, S_));
  PetscCall(KSPSetReusePreconditioner(ksp_, fresh_ ? PETSC_FALSE : PETSC_TRUE));
  PC pc;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(make_pivots_relative(pc, false));
  PetscCall(KSPSetUp(ksp_));
  PetscCall(make_pivots_relative(pc, true));
  PetscFunctionReturn(0);
}

/// Of a factored S; false where the factors do not tell.
PetscErrorCode InnerSolver::has_negative_pivots(bool* has) const {
  PC pc;
  PetscBool cholesky = PETSC_FALSE;
  PCFailedReason failed = PC_NOERROR;
  Mat factors = nullptr;
  PetscInt negative = 0, zero = 0, positive = 0;
  PetscFunctionBegin;
  *has = false;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCCHOLESKY, &cholesky));
  PetscCall(PCGetFailedReason(pc, &failed));
  if (!cholesky || failed != PC_NOERROR) {
    *has = cholesky && failed != PC_NOERROR;
    PetscFunctionReturn(0);
  }
  PetscCall(PCFactorGetMatrix(pc, &factors));
  PetscCall(MatGetInertia(factors, &negative, &zero, &positive));
  *has = negative + zero > 0;
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::assemble(CondensedCounts* counts) {
  bool negative = false;
  PetscFunctionBegin;
  // where S itself has to be solved with, its signs do not matter
  const bool definite = demand_.direction && (demand_.curvature == Curvature::definite || (may_modify() && !hope_));
  PetscCall(linearise(definite));
  if (direct_ && demand_.direction && !definite) {
    PetscCall(has_negative_pivots(&negative));
    if (negative) ++counts->indefinite;
  }
  indefinite_ = negative;
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::set_up_on_blocks() {
  PetscFunctionBegin;
  PetscCall(KSPSetUpOnBlocks(ksp_));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::run(KSP ksp, Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  PetscInt its = 0;
  PetscFunctionBegin;
  if (!own_rtol_) PetscCall(KSPSetTolerances(ksp, rtol_, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(KSPSolve(ksp, b, w));
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

PetscErrorCode InnerSolver::solve(Vec b, Vec w, CondensedCounts* counts, bool* solved) {
  KSPConvergedReason reason;
  PetscInt before = counts->iterations;
  PetscFunctionBegin;
  ++counts->solves;
  PetscCall(solve_definite(b, w, counts, &reason));
  *solved = reason > 0;
  bool finished = *solved;
  if (reason == KSP_DIVERGED_ITS && demand_.direction) {
    PetscCall(leads_downhill(b, w, solved));
    if (*solved) ++counts->unfinished;
  } else if (!*solved && !direct_ && !demand_.direction) {
    PetscCall(solve_indefinite(b, w, counts, solved));
  }
  if (definite_) ++counts->definite;
  if (*solved && !definite_ && !tangent_->exact_symmetric()) {
    PetscInt its = 0;
    PetscCall(correction_.apply(*tangent_, ksp_, rtol_, b, w, &its, &reason));
    counts->iterations += its;
    before += its;
    if (reason < 0 && !demand_.direction) *solved = false;
  }
  const double rate = static_cast<double>(counts->iterations - before) / std::max(1.0, -std::log10(rtol_));
  if (fresh_) rate_new_ = rate;
  stale_ = stale_ || !finished || rate > refresh_ * rate_new_ + 1;
  fresh_ = false;
  PetscFunctionReturn(0);
}

// A direct solver solves with an indefinite S as well, and what it gives may be a descent direction all the same, which
// leads to the nearest root in fewer iterations than any other: a symmetric lattice under pressure stays symmetric.
// Conjugate gradients stop at negative curvature. Where Newton's own direction leads uphill or cannot be had, and a direction is
// all that is asked for, the definite part of S takes the place of S.
PetscErrorCode InnerSolver::solve_definite(Vec b, Vec w, CondensedCounts* counts, KSPConvergedReason* reason) {
  bool downhill = true;
  PetscFunctionBegin;
  if (fresh_) ++counts->refreshed;
  PetscCall(run(ksp_, b, w, counts, reason));
  if (definite_ || !demand_.direction || (direct_ && !indefinite_)) PetscFunctionReturn(0);
  if (*reason > 0) PetscCall(leads_downhill(b, w, &downhill));
  indefinite_ = !downhill || (*reason < 0 && *reason != KSP_DIVERGED_ITS);
  if (!indefinite_) PetscFunctionReturn(0);
  if (!direct_) ++counts->indefinite;
  if (!may_modify()) PetscFunctionReturn(0);
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
  ++counts->indefinite;
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
  }
  PetscCall(tangent_->assemble(true, positive_));
  PetscCall(KSPSetOperators(fallback_, S_, positive_));
  PetscCall(run(fallback_, b, w, counts, &reason));
  *solved = reason > 0;
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::add_shifts(CondensedCounts* counts) const {
  PetscFunctionBegin;
  for (KSP ksp : {ksp_.get(), fallback_.get()}) {
    if (!ksp) continue;
    PC pc;
    PetscInt shifts = 0;
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(block_icc_shifts(pc, &shifts));
    counts->shifts += shifts;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::out_of_memory(bool* yes) const {
  PetscFunctionBegin;
  *yes = false;
  for (KSP ksp : {ksp_.get(), fallback_.get()}) {
    if (!ksp) continue;
    PC pc;
    PCFailedReason reason;
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCGetFailedReasonRank(pc, &reason));
    *yes = *yes || reason == PC_FACTOR_OUTMEMORY;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::view(PetscViewer viewer) const {
  PetscFunctionBegin;
  if (!ksp_) PetscFunctionReturn(0);
  PetscCall(PetscViewerASCIIPushTab(viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "S = sigma M - D - K/sigma is solved by\n"));
  PetscCall(KSPView(ksp_, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::describe(std::string* text) const {
  KSPType ksp_type;
  PCType pc_type;
  PC pc;
  const char* const names[] = {"springs, single precision", "SBAIJ", "BAIJ", "AIJ"};
  PetscFunctionBegin;
  if (!ksp_) PetscFunctionReturn(0);
  PetscCall(KSPGetType(ksp_, &ksp_type));
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(PCGetType(pc, &pc_type));
  *text = format("%s + %s on %s", ksp_type, pc_type, names[static_cast<int>(storage_)]);
  PetscFunctionReturn(0);
}

}  // namespace bs
