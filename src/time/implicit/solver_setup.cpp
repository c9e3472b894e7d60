#include "time/implicit/solver_setup.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/solver_options.hpp"
#include "time/implicit/linear_reuse.hpp"
#include "time/methods.hpp"

namespace bs {
namespace {

/// The linear solver that has a matrix to be set up with; null under -snes_mf.
PetscErrorCode solver_with_matrix(TS ts, KSP* ksp) {
  SNES snes;
  Mat P;
  PetscBool matrix_free = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetJacobian(snes, nullptr, &P, nullptr, nullptr));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(P), MATMFFD, &matrix_free));
  *ksp = nullptr;
  if (!matrix_free) PetscCall(linear_solver_of(ts, ksp, nullptr));
  PetscFunctionReturn(0);
}

/// Whether solvers of the user's own choice are worth setting up to see if they can be: what cannot work, some pair of
/// matrix and preconditioner, is then refused before the first frame.
PetscErrorCode worth_trying(PC pc, const TSContext& context, bool* yes) {
  constexpr PetscInt MOST = 60000;  // unknowns; above them the set-up may take long, and is left to the first step
  PetscInt unknowns = 0;
  CondensedCounts counts;
  bool condensed = false;
  PetscFunctionBegin;
  *yes = false;
  PetscCall(condensed_counts(pc, &condensed, &counts));
  if (condensed) PetscFunctionReturn(0);  // the age of its factors counts from their set-up
  PetscCall(VecGetSize(context.model->initial_state(), &unknowns));
  for (const char* name : {"-pc_type", "-ksp_type", "-mat_type", "-snes_type"}) {
    PetscBool given = PETSC_FALSE;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, name, &given));
    *yes = *yes || (given && unknowns <= MOST);
  }
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode wants_solvers_early(TS ts, const TSContext& context, bool unread, bool* wants) {
  PC pc;
  bool blocks = false, own_choice = false;
  PetscFunctionBegin;
  *wants = false;
  if (!context.implicit) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(has_blocks(pc, &blocks));
  PetscCall(worth_trying(pc, context, &own_choice));
  *wants = unread || own_choice || context.model->linear() || blocks;
  PetscFunctionReturn(0);
}

PetscErrorCode factor_first_matrix(TS ts, TSContext& context, double h) {
  SNES snes;
  KSP ksp;
  Vec y;
  PetscReal t;
  double sigma;
  VecHandle zero;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(shift_of_step(ts, h, &sigma));
  PetscCall(VecDuplicate(y, zero.out()));
  PetscCall(VecZeroEntries(zero));
  PetscCall(SNESSetSolution(snes, zero));  // some types make their vectors like it
  PetscCall(SNESSetUp(snes));
  PetscCall(solver_with_matrix(ts, &ksp));
  if (!ksp) PetscFunctionReturn(0);
  PetscCall(context.model->jacobian(t, y, zero, sigma, context.form, context.matrix));
  PetscCall(KSPSetOperators(ksp, context.operator_, context.matrix));
  PetscCall(KSPSetUp(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode set_up_solvers(TS ts, TSContext& context) {
  KSP ksp;
  PC pc;
  PetscReal h;
  PetscFunctionBegin;
  PetscCall(TSSetUp(ts));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(factor_first_matrix(ts, context, h));
  PetscCall(solver_with_matrix(ts, &ksp));
  if (!ksp) PetscFunctionReturn(0);
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(make_pivots_relative(pc, true));
  PetscCall(KSPSetUpOnBlocks(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode check_first_matrix(TS ts, TSContext& context) {
  KSP ksp;
  PetscFunctionBegin;
  PetscCall(solver_with_matrix(ts, &ksp));
  PetscCall(context.model->check_solver(ksp));
  PetscFunctionReturn(0);
}

}  // namespace bs
