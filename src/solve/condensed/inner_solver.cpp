#include "solve/condensed/inner_solver.hpp"
#include <algorithm>
#include <cmath>
#include "base/fault.hpp"
#include "model/particles/condensed/block_icc.hpp"
#include "solve/condensed/condensed.hpp"

namespace bs {

PetscErrorCode InnerSolver::create(Tangent& tangent, const char* outer_prefix) {
  PetscReal refresh = refresh_;
  PetscBool given = PETSC_FALSE;
  PetscFunctionBegin;
  tangent_ = &tangent;
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
  direct_ = tangent_->unknowns() <= DIRECT_UNKNOWNS;
  const std::string own = type;
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
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::set_defaults() {
  PC pc;
  PetscMPIInt ranks;
  const bool symmetric = tangent_->exact_symmetric();
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCallMPI(MPI_Comm_size(tangent_->comm(), &ranks));
  if (direct_ && storage_ == CondensedStorage::aij) {
    PetscCall(KSPSetType(ksp_, KSPPREONLY));
    PetscCall(PCSetType(pc, PCLU));
    if (ranks > 1 || tangent_->unknowns() > 1000) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    PetscFunctionReturn(0);
  }
  PetscCall(KSPSetType(ksp_, symmetric || storage_ == CondensedStorage::springs || storage_ == CondensedStorage::sbaij ? KSPCG : KSPGMRES));
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

// A direct solver wants the matrix as it is; a Krylov method bears an old preconditioner until it costs more iterations
// than a new one would.
PetscErrorCode InnerSolver::assemble() {
  PetscFunctionBegin;
  PetscCall(tangent_->assemble(false, S_));
  const double sigma = tangent_->sigma();
  fresh_ = direct_ || refresh_ <= 0 || stale_ || std::abs(sigma - sigma_) > 0.1 * sigma_;
  if (fresh_) sigma_ = sigma;
  stale_ = false;
  PetscCall(KSPSetOperators(ksp_, S_, S_));
  PetscCall(KSPSetReusePreconditioner(ksp_, fresh_ ? PETSC_FALSE : PETSC_TRUE));
  PetscCall(KSPSetUp(ksp_));
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

PetscErrorCode InnerSolver::solve(Vec b, Vec w, CondensedCounts* counts, bool* solved) {
  KSPConvergedReason reason;
  PetscInt before = counts->iterations;
  PetscFunctionBegin;
  ++counts->solves;
  if (fresh_) ++counts->refreshed;
  PetscCall(run(ksp_, b, w, counts, &reason));
  *solved = reason > 0;
  if (!*solved && !direct_) PetscCall(solve_indefinite(b, w, counts, solved));
  const double rate = static_cast<double>(counts->iterations - before) / std::max(1.0, -std::log10(rtol_));
  if (fresh_) rate_new_ = rate;
  stale_ = !*solved || rate > refresh_ * rate_new_ + 1;
  fresh_ = false;
  PetscFunctionReturn(0);
}

// CG needs S positive definite. Where it is not (springs under compression, large steps), MINRES on S with the
// preconditioner of the positive definite part.
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
