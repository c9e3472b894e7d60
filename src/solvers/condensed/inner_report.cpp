// What the inner solver says of itself: in the header, in the report, after a failure.
#include "base/error.hpp"
#include "solvers/condensed/condensed.hpp"
#include "solvers/condensed/inner_solver.hpp"

namespace bs {

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
  PetscErrorCode (*coarse_words)(PC, const char**) = nullptr;
  const char* coarse = "";
  PetscCall(PetscObjectQueryFunction(reinterpret_cast<PetscObject>(pc), "BSCoarseWords_C", &coarse_words));
  if (coarse_words) PetscCall(coarse_words(pc, &coarse));
  *text = format("%s + %s%s%s on %s%s%s", ksp_type, pc_type, *coarse ? " with " : "", coarse, names[static_cast<int>(storage_)],
                 why_.empty() ? "" : "; ", why_.c_str());
  PetscFunctionReturn(0);
}

std::string InnerSolver::failure() const {
  if (failed_ >= 0 || failed_ == KSP_DIVERGED_INDEFINITE_MAT) return "";
  if (failed_ != KSP_DIVERGED_ITS) return format("the linear solver broke down (%s)", KSPConvergedReasons[failed_]);
  PetscInt most = 0;
  (void)KSPGetTolerances(ksp_, nullptr, nullptr, nullptr, &most);
  return format("the linear solver ran out of its %lld iterations (-%sksp_max_it)", static_cast<long long>(most), prefix_.c_str());
}

PetscErrorCode InnerSolver::add_shifts(CondensedCounts* counts) const {
  PetscFunctionBegin;
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
