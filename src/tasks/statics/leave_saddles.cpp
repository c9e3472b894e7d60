// What Newton's method has found, made better: saddle points of the energy are left, and forces that have nearly vanished are balanced.
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/petsc_versions.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/own_solve.hpp"
#include "tasks/statics/pseudo_time.hpp"
#include "tasks/statics/saddle_point.hpp"
#include "time/methods.hpp"

namespace bs {

// The energy falls from one saddle point to the next, so that none is met twice. Where that does not lead to a minimum, what Newton's method has
// found stays.
PetscErrorCode PseudoTime::leave_saddles(SNES snes) {
  constexpr int MOST_SADDLES = 20;
  Vec X;
  PC pc;
  VecHandle first;
  double t = 0;
  bool left = false, exact = false, stable = false;
  PetscFunctionBegin;
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(make_room(X));
  PetscCall(time_of_loads(&t));
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  for (int k = 0; k < MOST_SADDLES; ++k) {
    PetscInt negative = 0;
    bool found = false, lower = false, good = false;
    PetscCall(find_unstable_direction(ts_, context_->matrix, *model_, t, X, iterations_, direction_, &negative, &found));
    if (found) PetscCall(step_down(*model_, t, X, direction_, at_, &lower));
    PetscCall(condensed_renew(pc));
    stable = negative <= 0 && !found;
    if (stable) {
      PetscCall(copy_into(&minimum_.at, X));
      minimum_.time = t;
      minimum_.negative = negative;
      break;
    }
    if (!first) {
      PetscCall(copy_into(&first, X));
    }
    if (!lower && negative > 0 && !exact) {
      exact = true;
      PetscCall(solve_to_rounding(snes));
      continue;
    }
    if (!lower) break;
    PetscCall(continue_further(snes, &good));
    if (!good) break;
    left = true;
    exact = false;
  }
  if (stable && left) ++saddles_;
  if (!stable && first) PetscCall(VecCopy(first, X));
  PetscFunctionReturn(0);
}

PetscErrorCode PseudoTime::is_found_minimum(double t, Vec y, PetscInt* negative, bool* yes) const {
  bool same = minimum_.at && minimum_.time == t, other = false;
  PetscFunctionBegin;
  if (same) {
    const ReadArray a(y), b(minimum_.at);
    layout_of(y).for_each([&](PetscInt x, PetscInt) { same = same && a[x] == b[x]; });
  }
  PetscCall(on_some_rank(model_->comm(), !same, &other));
  *yes = !other;
  *negative = minimum_.negative;
  PetscFunctionReturn(0);
}

// What the tolerance leaves of the forces presses bars that bear nothing else, which then seem to buckle: corrections by the tangent as it is, for as
// long as each takes half of the forces away.
PetscErrorCode PseudoTime::solve_to_rounding(SNES snes) {
  constexpr int MOST = 8;
  double before = 0, left = 0, inertia = 0;
  bool solved = true, definite = true;
  Vec X;
  PetscFunctionBegin;
  newton_steps_ = krylov_ = 0;
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(model_->set_motion(0, X));
  for (int k = 0; k <= MOST && solved; ++k) {
    PetscCall(SNESComputeFunction(snes, X, snes->vec_func));
    PetscCall(model_->step_forces(X, snes->vec_func, &left, &inertia));
    if (k > 0 && !(left <= 0.5 * before)) break;
    before = left;
    PetscCall(VecCopy(X, saddle_));
    PetscCall(linear_solve(snes, X, correction_, &solved, &definite));
    PetscCall(zero_velocities(correction_));
    if (solved) PetscCall(VecAXPY(X, -1, correction_));
  }
  PetscCall(VecCopy(saddle_, X));
  domain_error(snes) = PETSC_FALSE;
  snes->iter += newton_steps_;
  snes->linear_its += krylov_;
  PetscFunctionReturn(0);
}

// What Newton's method leaves within the rounding errors of all forces may be too much where the forces themselves have nearly vanished, as in a net
// that relaxes until it is floppy: a shorter load step would not mend that.
PetscErrorCode PseudoTime::balance_better(SNES snes) {
  bool yes = false, good = false;
  double t = 0;
  Vec X;
  PetscFunctionBegin;
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(time_of_loads(&t));
  PetscCall(model_->is_balanced(t, X, &yes));
  if (yes) PetscFunctionReturn(0);
  PetscCall(make_room(X));
  PetscCall(solve_to_rounding(snes));
  PetscCall(model_->is_balanced(t, X, &yes));
  if (yes) PetscFunctionReturn(0);
  PetscCall(VecCopy(X, at_));
  PetscCall(zero_velocities(at_));
  PetscCall(continue_further(snes, &good));
  PetscFunctionReturn(0);
}

// A solve that has succeeded, from at_: its reason stays.
PetscErrorCode PseudoTime::continue_further(SNES snes, bool* good) {
  const SNESConvergedReason reason = snes->reason;
  PetscFunctionBegin;
  PetscCall(continue_from(snes));
  *good = snes->reason > 0;
  snes->reason = reason;
  PetscFunctionReturn(0);
}

}  // namespace bs
