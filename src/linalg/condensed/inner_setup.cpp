// Sets up the inner solver from its options (storage of S, solver, preconditioner), and describes it for the header, the report and error messages.
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/condensed/inner_solver.hpp"
#include "linalg/solver_options.hpp"

namespace bs {

PetscErrorCode InnerSolver::create(Tangent& tangent, const CondensedDemand& demand, const char* outer_prefix) {
  constexpr double CHEAP = 1, DEAR = 1.3;  // default of -refresh for factors of springs, which take the time of five iterations, and for others
  PetscReal refresh = CHEAP;
  PetscBool given = PETSC_FALSE, own_refresh = PETSC_FALSE;
  PetscFunctionBegin;
  tangent_ = &tangent;
  demand_ = demand;
  prefix_ = std::string(outer_prefix ? outer_prefix : "") + "condensed_";
  const char* const names[] = {"springs", "sbaij", "baij", "aij"};
  PetscInt chosen = -1;
  PetscOptionsBegin(tangent.comm(), prefix_.c_str(), "Condensed solve of S w = b, S = sigma M - D - K/sigma", "PC");
  PetscCall(
      PetscOptionsReal("-refresh",
                       "renew the preconditioner when a solve takes this many times the iterations per digit that it took with a new one, and one "
                       "more; 0: always; the default is 1 for factors of springs, 1.3 for others [1]",
                       "", refresh, &refresh, &own_refresh));
  PetscCall(PetscOptionsEList("-mat_type",
                              "storage of S: springs (single precision, own kernels) or a PETSc matrix; the default depends on -condensed_pc_type",
                              "", names, 4, "springs", &chosen, &given));
  PetscOptionsEnd();
  if (given) own_storage_ = static_cast<int>(chosen);
  PetscCall(PetscOptionsHasName(nullptr, prefix_.c_str(), "-ksp_rtol", &given));
  own_rtol_ = given;
  PetscCall(choose_solver());
  PetscCall(create_solver());
  refresh_ = own_refresh || storage_ == CondensedStorage::springs ? refresh : DEAR;
  PetscFunctionReturn(0);
}

/// Chooses the storage of S, which depends on the type of the solver, then creates S and the solver and reads all other options.
PetscErrorCode InnerSolver::create_solver() {
  PetscBool preonly = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(tangent_->create(storage_, S_.out()));
  PetscCall(MatSetOptionsPrefix(S_, prefix_.c_str()));
  PetscCall(KSPCreate(tangent_->comm(), ksp_.out()));
  PetscCall(KSPSetOptionsPrefix(ksp_, prefix_.c_str()));
  PetscCall(KSPSetOperators(ksp_, S_, S_));
  PetscCall(set_defaults());
  PetscCall(KSPSetFromOptions(ksp_));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(ksp_.get()), KSPPREONLY, &preonly));
  direct_ = preonly;
  PetscCall(ask_for_inertia());
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::ask_for_inertia() {
  PC pc;
  PCType type = nullptr;
  MatSolverType solver = nullptr;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(PCGetType(pc, &type));
  if (std::string(type) != PCCHOLESKY || (!demand_.direction && !demand_.inertia)) PetscFunctionReturn(0);
  PetscCall(PCFactorGetMatSolverType(pc, &solver));
  if (solver && std::string(solver) == MATSOLVERMUMPS) PetscCall(count_mumps_pivots(pc));
  PetscFunctionReturn(0);
}

// S is symmetric: Cholesky takes half the work of LU, and the signs of its pivots tell whether S is positive definite. PETSc's own factors one
// unknown after the other, which is quicker as long as there is little to do for each of them; each of several ranks then factors all of S, since
// messages would take longer. MUMPS works on dense blocks, and divides them among ranks.
// User times with PETSc's own and MUMPS: 40 load steps of a diluted net of 50 x 50 (1.7e3 operations for each unknown, several solves with each
// factor) 8.7 and 49 s, two of them on two ranks 11 and 40 s; 4 of a diluted periodic net of 40 x 40 (7e3) 9.3 and 3.3 s, two on two ranks,
// elapsed, 2.5 and 1.5 s; 20 time steps of a net of 50 x 50 (3.6e3) 0.80 and 0.72 s, a cube of 7^3 (1.9e4) 0.42 and 0.34 s.
PetscErrorCode InnerSolver::set_direct(PC pc, PCType type, PetscMPIInt ranks) {
  constexpr double LITTLE = 1e7, THIN = 5e3;  // operations in all, and per unknown
  PetscBool own_type = PETSC_FALSE, own_package = PETSC_FALSE;
  PC factors = pc;
  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(nullptr, prefix_.c_str(), "-pc_type", &own_type));
  PetscCall(PetscOptionsHasName(nullptr, prefix_.c_str(), "-pc_factor_mat_solver_type", &own_package));
  const bool thin = flops_ >= 0 && flops_ <= std::max(LITTLE, THIN * static_cast<double>(tangent_->unknowns()));
  const bool redundant = thin && ranks > 1 && !own_type && !own_package;
  PetscCall(KSPSetType(ksp_, KSPPREONLY));
  PetscCall(PCSetType(pc, redundant ? PCREDUNDANT : type));
  PetscCall(factoring_pc(pc, &factors));
  PetscCall(PCSetType(factors, type));
  if (thin && (ranks == 1 || redundant)) PetscCall(PCFactorSetMatOrderingType(factors, LEAST_FILL));
  else PetscCall(PCFactorSetMatSolverType(factors, MATSOLVERMUMPS));
  PetscCall(PCFactorSetZeroPivot(factors, PETSC_MACHINE_EPSILON * PETSC_MACHINE_EPSILON));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::set_defaults() {
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp_, &pc));
  const PetscMPIInt ranks = size_of(tangent_->comm());
  if (direct_ && storage_ == CondensedStorage::aij) {
    char type[64] = PCCHOLESKY;
    PetscCall(PetscOptionsGetString(nullptr, prefix_.c_str(), "-pc_type", type, sizeof type, nullptr));
    PetscCall(set_direct(pc, type, ranks));
    PetscFunctionReturn(0);
  }
  PetscCall(KSPSetType(ksp_, KSPCG));
  // the norm that Newton's tolerance is meant for; some other methods can only use another one
  char own[64] = KSPCG;
  PetscCall(PetscOptionsGetString(nullptr, prefix_.c_str(), "-ksp_type", own, sizeof own, nullptr));
  if (std::string(own) == KSPCG) PetscCall(KSPSetNormType(ksp_, KSP_NORM_UNPRECONDITIONED));
  PetscCall(KSPSetTolerances(ksp_, rtol_, 0.0, 1e8, 2000));
  PetscCall(PCSetType(pc, storage_ == CondensedStorage::springs ? "bicc" : tangent_->pairwise() ? PCBJACOBI : PCGAMG));
  if (storage_ == CondensedStorage::sbaij) PetscCall(PCSetType(pc, ranks > 1 ? PCBJACOBI : PCICC));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolver::create_vector(Vec* out) const {
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(S_, out, nullptr));
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
  PC pc, factors;
  const char* const names[] = {"springs, single precision", "SBAIJ", "BAIJ", "AIJ"};
  PetscFunctionBegin;
  if (!ksp_) PetscFunctionReturn(0);
  PetscCall(KSPGetType(ksp_, &ksp_type));
  PetscCall(KSPGetPC(ksp_, &pc));
  PetscCall(factoring_pc(pc, &factors));
  PetscCall(PCGetType(factors, &pc_type));
  PetscErrorCode (*coarse_words)(PC, const char**) = nullptr;
  const char* coarse = "";
  PetscCall(PetscObjectQueryFunction(reinterpret_cast<PetscObject>(pc), "BSCoarseDescription_C", &coarse_words));
  if (coarse_words) PetscCall(coarse_words(pc, &coarse));
  *text = format("%s + %s%s%s%s on %s%s%s", ksp_type, pc_type, factors == pc ? "" : " of the whole on each rank", *coarse ? " with " : "", coarse,
                 names[static_cast<int>(storage_)], why_.empty() ? "" : "; ", why_.c_str());
  PetscFunctionReturn(0);
}

std::string InnerSolver::failure() const {
  if (failed_ >= 0 || failed_ == KSP_DIVERGED_INDEFINITE_MAT) return "";
  if (failed_ != KSP_DIVERGED_ITS) return format("the linear solver broke down (%s)", KSPConvergedReasons[failed_]);
  PetscInt most = 0;
  (void)KSPGetTolerances(ksp_, nullptr, nullptr, nullptr, &most);
  return format("the linear solver ran out of its %s (-%sksp_max_it)", how_many(most, "iteration").c_str(), prefix_.c_str());
}

PetscErrorCode InnerSolver::add_counts(CondensedCounts* counts) const {
  PetscFunctionBegin;
  counts->shifts += shifts_before_;
  counts->factored += factored_;
  for (KSP ksp : {ksp_.get(), fallback_.get()}) {
    if (!ksp) continue;
    PC pc;
    PetscInt shifts = 0;
    PetscCall(KSPGetPC(ksp, &pc));
    PetscErrorCode (*factor_shifts)(PC, PetscInt*) = nullptr;
    PetscCall(PetscObjectQueryFunction(reinterpret_cast<PetscObject>(pc), "BSFactorShifts_C", &factor_shifts));
    if (factor_shifts) PetscCall(factor_shifts(pc, &shifts));
    counts->shifts += shifts;
  }
  PetscFunctionReturn(0);
}

std::vector<KSP> InnerSolver::solvers() const {
  std::vector<KSP> all;
  for (KSP ksp : {ksp_.get(), fallback_.get()})
    if (ksp) all.push_back(ksp);
  return all;
}

}  // namespace bs
