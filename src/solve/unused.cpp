// Options that nobody asked for: told before the first step, and again at the end.
#include <algorithm>
#include "base/fault.hpp"
#include "solve/linear_reuse.hpp"
#include "solve/pivots.hpp"
#include "solve/ts_queries.hpp"
#include "solve/ts_setup.hpp"

namespace bs {
namespace {

/// PETSc reads these only when it ends, or prints by them at points of the run still ahead.
bool read_late(const std::string& name) {
  for (const char* part : {"view", "monitor", "converged_reason", "options_left", "log_", "malloc", "objects_dump", "citations",
                           "memory", "get_total_flops", "on_error", "saws", "help", "trace", "info", "mat_mumps", "options_file"})
    if (name.find(part) != std::string::npos) return true;
  return false;
}

/// Assembles the first Jacobian and sets the linear solver up with it, so that inner solvers read their options too.
PetscErrorCode set_up_solvers(TS ts, TSContext& context) {
  SNES snes;
  KSP ksp;
  PC pc;
  Vec y;
  PetscReal h, t;
  double sigma;
  PetscFunctionBegin;
  PetscCall(TSSetUp(ts));
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(shift_of_step(ts, h, &sigma));
  VecHandle zero;
  PetscCall(VecDuplicate(y, zero.out()));
  PetscCall(VecZeroEntries(zero));
  PetscCall(context.model->jacobian(t, y, zero, sigma, context.form, context.matrix));
  PetscCall(SNESSetSolution(snes, zero));  // some types make their vectors like it
  PetscCall(SNESSetUp(snes));
  Mat A, P;
  PetscCall(SNESGetJacobian(snes, &A, &P, nullptr, nullptr));
  PetscBool shell = PETSC_FALSE;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(P), MATMFFD, &shell));
  if (!shell) {
    PetscCall(KSPSetOperators(ksp, context.operator_, context.matrix));
    PetscCall(KSPSetUp(ksp));
    PetscCall(make_pivots_relative(pc, true));
    PetscCall(KSPSetUpOnBlocks(ksp));
  }
  PetscCall(context.model->check_solver(shell ? nullptr : ksp));
  PetscFunctionReturn(0);
}

/// Whether solvers of the user's own choice are worth setting up to see if they can be: what cannot work, some pair of
/// matrix and preconditioner, is then refused before the first frame.
PetscErrorCode worth_trying(TS ts, TSContext& context, bool* yes) {
  constexpr PetscInt MOST = 60000;  // unknowns; above them the set-up may take long, and is left to the first step
  PetscInt unknowns = 0;
  PC pc;
  PetscBool condensed = PETSC_FALSE;
  PetscFunctionBegin;
  *yes = false;
  if (!context.implicit) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), "condensed", &condensed));
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

PetscErrorCode unused_options(std::vector<std::string>* names) {
  PetscInt count = 0;
  char **left = nullptr, **values = nullptr;
  PetscFunctionBegin;
  names->clear();
  PetscCall(PetscOptionsLeftGet(nullptr, &count, &left, &values));
  for (PetscInt k = 0; k < count; ++k) {
    std::string name = left[k];
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (!read_late(name)) names->push_back("-" + name);
  }
  PetscCall(PetscOptionsLeftRestore(nullptr, &count, &left, &values));
  PetscFunctionReturn(0);
}

PetscErrorCode warn_unused_options(TS ts, TSContext& context) {
  std::vector<std::string> names;
  PetscFunctionBegin;
  PetscCall(TSSetUp(ts));
  PetscCall(unused_options(&names));
  bool blocks = false, own_choice = false;
  if (context.implicit) {
    PC pc;
    PetscCall(linear_solver_of(ts, nullptr, &pc));
    PetscCall(has_blocks(pc, &blocks));
  }
  PetscCall(worth_trying(ts, context, &own_choice));
  if (context.implicit && (!names.empty() || own_choice || context.model->linear() || blocks)) {
    PetscCall(set_up_solvers(ts, context));
    PetscCall(unused_options(&names));
  }
  for (const std::string& name : names)
    PetscCall(warn(PetscObjectComm(reinterpret_cast<PetscObject>(ts)),
                   "option " + name + " is not used by this run: misspelt, or of a solver that is not chosen"));
  PetscFunctionReturn(0);
}

}  // namespace bs
