#include "linalg/condensed/condensed.hpp"
#include <petsc/private/pcimpl.h>  // of types of PC; PCSetPreSolve() is gone since 3.24
#include <string>
#include "base/attached.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "linalg/condensed/inner_solver.hpp"

namespace bs {
namespace {

constexpr char TYPE[] = "condensed", MARK[] = "bs_tangent";

struct Condensed {
  Tangent* tangent = nullptr;
  CondensedDemand demand;
  InnerSolver inner;
  VecHandle b, w;
  CondensedCounts counts;
};

Condensed& data_of(PC pc) { return *static_cast<Condensed*>(pc->data); }

/// The inner solver, once it is known what for.
PetscErrorCode prepare(PC pc) {
  Condensed& self = data_of(pc);
  PetscFunctionBegin;
  if (!self.tangent) self.tangent = tangent_of(pc->pmat);
  PetscCheck(self.tangent, PetscObjectComm(reinterpret_cast<PetscObject>(pc)), PETSC_ERR_SUP, "-pc_type condensed is for particle systems");
  if (!self.inner.created()) {
    const char* prefix = nullptr;
    PetscCall(PCGetOptionsPrefix(pc, &prefix));
    PetscCall(self.inner.create(*self.tangent, self.demand, prefix));
    PetscCall(self.inner.create_vector(self.b.out()));
    PetscCall(self.inner.create_vector(self.w.out()));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode set_up(PC pc) {
  PetscFunctionBegin;
  PetscCall(prepare(pc));
  PetscCall(data_of(pc).inner.assemble(&data_of(pc).counts));
  pc->failedreason = PC_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode set_up_on_blocks(PC pc) {
  PetscFunctionBegin;
  PetscCall(data_of(pc).inner.set_up_on_blocks());
  PetscFunctionReturn(0);
}

/// The outer solver's tolerance is the inner's where the outer does nothing else; flexible methods bear a loose inner
/// solve, others need the same preconditioner every time.
PetscErrorCode before_solve(PC pc, KSP outer, Vec, Vec) {
  PetscBool preonly = PETSC_FALSE, flexible = PETSC_FALSE;
  PetscReal rtol;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(outer), KSPPREONLY, &preonly));
  PetscCall(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(outer), &flexible, KSPFGMRES, KSPGCR, KSPRICHARDSON, ""));
  PetscCall(KSPGetTolerances(outer, &rtol, nullptr, nullptr, nullptr));
  data_of(pc).inner.set_tolerance(preonly ? rtol : flexible ? LOOSE_TOLERANCE : 0.1 * rtol);
  PetscFunctionReturn(0);
}

/// A failed solve is told to the solve it belongs to, not to those after it.
PetscErrorCode after_solve(PC pc, KSP, Vec, Vec) {
  PetscFunctionBegin;
  pc->failedreason = PC_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode apply(PC pc, Vec r, Vec z) {
  Condensed& self = data_of(pc);
  bool solved = false;
  PetscFunctionBegin;
  PetscCall(self.tangent->condense(r, self.b));
  PetscCall(self.inner.solve(self.b, self.w, &self.counts, &solved));
  if (!solved) PetscCall(PCSetFailedReason(pc, PC_SUBPC_ERROR));
  PetscCall(self.tangent->expand(r, self.w, z));
  PetscFunctionReturn(0);
}

PetscErrorCode view(PC pc, PetscViewer viewer) {
  PetscFunctionBegin;
  PetscCall(data_of(pc).inner.view(viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode destroy(PC pc) {
  PetscFunctionBegin;
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSInnerSolvers_C", nullptr));
  delete static_cast<Condensed*>(pc->data);
  pc->data = nullptr;
  PetscFunctionReturn(0);
}

/// Of S, borrowed.
PetscErrorCode inner_solvers(PC pc, std::vector<KSP>* out) {
  PetscFunctionBegin;
  *out = data_of(pc).inner.solvers();
  PetscFunctionReturn(0);
}

PetscErrorCode create(PC pc) {
  PetscFunctionBegin;
  PetscCall(PetscObjectComposeFunction(reinterpret_cast<PetscObject>(pc), "BSInnerSolvers_C", inner_solvers));
  pc->data = new Condensed;
  pc->ops->setup = set_up;
  pc->ops->setuponblocks = set_up_on_blocks;
  pc->ops->presolve = before_solve;
  pc->ops->postsolve = after_solve;
  pc->ops->apply = apply;
  pc->ops->view = view;
  pc->ops->destroy = destroy;
  PetscFunctionReturn(0);
}

PetscErrorCode is_condensed(PC pc, bool* is) {
  PetscBool same = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), TYPE, &same));
  *is = same;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode attach_tangent(Mat P, Tangent* tangent) {
  PetscFunctionBegin;
  PetscCall(attach(P, MARK, tangent));
  PetscFunctionReturn(0);
}

Tangent* tangent_of(Mat P) { return P ? attached<Tangent>(P, MARK) : nullptr; }

PetscErrorCode register_condensed() {
  PetscFunctionBegin;
  PetscCall(PCRegister(TYPE, create));
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_counts(PC pc, bool* is, CondensedCounts* counts) {
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, is));
  if (*is) *counts = data_of(pc).counts;
  if (*is) PetscCall(data_of(pc).inner.add_counts(counts));
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_failure(PC pc, std::string* text) {
  bool is = false;
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, &is));
  *text = is ? data_of(pc).inner.failure() : "";
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_set_tangent(PC pc, Tangent* tangent, const CondensedDemand& demand) {
  bool is = false;
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, &is));
  if (!is) PetscFunctionReturn(0);
  data_of(pc).tangent = tangent;
  data_of(pc).demand = demand;
  data_of(pc).inner.set_demand(demand);
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_demand(PC pc, CondensedDemand* demand) {
  bool is = false;
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, &is));
  if (is) *demand = data_of(pc).demand;
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_renew(PC pc) {
  bool is = false;
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, &is));
  if (is) data_of(pc).inner.renew();
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_reuse_factors(PC pc, bool yes) {
  bool is = false;
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, &is));
  if (is) data_of(pc).inner.reuse_factors(yes);
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_create_inner(PC pc) {
  bool is = false;
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, &is));
  if (is) PetscCall(prepare(pc));
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_negative_pivots(PC pc, PetscInt* count) {
  bool is = false;
  PetscFunctionBegin;
  *count = -1;
  PetscCall(is_condensed(pc, &is));
  if (!is) PetscFunctionReturn(0);
  PetscCall(prepare(pc));
  PetscCall(data_of(pc).inner.negative_pivots(count));
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_negative_direction(PC pc, Vec r, PetscInt most, Vec z, bool* found) {
  bool is = false;
  PetscFunctionBegin;
  *found = false;
  PetscCall(is_condensed(pc, &is));
  if (!is) PetscFunctionReturn(0);
  PetscCall(prepare(pc));
  Condensed& self = data_of(pc);
  PetscCall(self.tangent->condense(r, self.b));
  PetscCall(self.inner.negative_direction(self.b, most, self.w, found));
  if (*found) PetscCall(self.tangent->expand(r, self.w, z));
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_solve_definite(PC pc, double rtol, Vec r, Vec z, bool* solved) {
  CondensedCounts counts;
  CondensedDemand definite;
  PetscFunctionBegin;
  PetscCall(prepare(pc));
  Condensed& self = data_of(pc);
  definite.direction = true;
  definite.curvature = Curvature::definite;
  self.inner.set_demand(definite);
  self.inner.set_tolerance(rtol);
  PetscCall(self.inner.assemble(&counts));
  PetscCall(self.tangent->condense(r, self.b));
  PetscCall(self.inner.solve(self.b, self.w, &counts, solved));
  PetscCall(self.tangent->expand(r, self.w, z));
  self.inner.set_demand(self.demand);
  self.counts.iterations += counts.iterations;
  self.counts.refreshed += counts.refreshed;
  PetscFunctionReturn(0);
}

PetscErrorCode condensed_describe(PC pc, std::string* text) {
  bool is = false;
  PetscFunctionBegin;
  PetscCall(is_condensed(pc, &is));
  text->clear();
  if (is) PetscCall(data_of(pc).inner.describe(text));
  PetscFunctionReturn(0);
}

}  // namespace bs
