#include "tasks/statics/pseudo_time.hpp"
#include <petsc/private/tsimpl.h>
#include <algorithm>
#include <utility>
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/own_solve.hpp"
#include "time/methods.hpp"
#include "time/starter.hpp"

namespace bs {

PetscErrorCode PseudoTime::attach(TS ts, TSContext& context, Equilibrium& model, double nominal) {
  SNES snes;
  PC pc;
  CondensedDemand demand;
  PetscBool newton = PETSC_FALSE;
  PetscFunctionBegin;
  ts_ = ts;
  context_ = &context;
  model_ = &model;
  nominal_ = nominal;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESNEWTONLS, &newton));
  PetscCall(attach_own_solve(snes, this, &newton_));
  if (newton) PetscFunctionReturn(0);
  other_ = true;
  fallback_ = Fallback::never;
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_demand(pc, &demand));
  demand.inertia = true;  // pivots are looked at whatever the solver
  PetscCall(condensed_set_tangent(pc, model.tangent(), demand));
  PetscFunctionReturn(0);
}

PetscErrorCode PseudoTime::solve(SNES snes) {
  constexpr double SHORT = 1.0 / 60;
  PetscReal h, from;
  SNESConvergedReason reason;
  PetscFunctionBegin;
  model_->begin_solve();
  PetscCall(newton_(snes));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(TSGetTime(ts_, &from));
  if (reason >= 0 || fallback_ == Fallback::never) PetscFunctionReturn(0);
  if (fallback_ == Fallback::late && (h > SHORT * nominal_ || from == tried_)) PetscFunctionReturn(0);
  if (fallback_ == Fallback::late) tried_ = from;
  PetscCall(continue_from_start(snes));
  PetscFunctionReturn(0);
}

// The stage of the last step is solved again: its residual does not depend on where the step came from. Newton starts at y, not where the
// predictor would.
PetscErrorCode PseudoTime::solve_from(Vec y, bool* good) {
  SNES snes;
  SNESConvergedReason reason;
  PetscReal time;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts_, &snes));
  if (!room_) PetscCall(VecDuplicate(y, room_.out()));
  PetscCall(VecCopy(y, room_));
  const auto guess = snes->ops->computeinitialguess;
  snes->ops->computeinitialguess = nullptr;
  aside_ = true;
  PetscCall(SNESSolve(snes, nullptr, room_));
  aside_ = false;
  snes->ops->computeinitialguess = guess;
  PetscCall(SNESGetConvergedReason(snes, &reason));
  ts_->snes_its += snes->iter;
  *good = reason > 0;
  if (*good && context_->examine) {
    StageCheck found;
    PetscCall(TSGetTime(ts_, &time));
    PetscCall(context_->examine(time, room_, &found));
    *good = found.good;
  }
  if (*good) PetscCall(VecCopy(room_, y));
  PetscFunctionReturn(0);
}

PetscErrorCode PseudoTime::relax(Vec y, bool* good) {
  PetscFunctionBegin;
  fallback_ = other_ ? Fallback::never : Fallback::always;
  PetscCall(solve_from(y, good));
  fallback_ = other_ ? Fallback::never : Fallback::late;
  PetscFunctionReturn(0);
}

// Newton's convergence test takes the step's length from TS; what statics needs of rtol is more than a motion does.
PetscErrorCode PseudoTime::advance(double h, Vec y, bool* good) {
  constexpr double RTOL = 1e-11;  // so that the same springs break on any number of ranks
  PetscReal of_loads, rtol;
  SNES snes;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts_, &snes));
  PetscCall(SNESGetTolerances(snes, nullptr, &rtol, nullptr, nullptr, nullptr));
  PetscCall(TSGetTimeStep(ts_, &of_loads));
  PetscCall(TSSetTimeStep(ts_, h));
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, std::max(rtol, RTOL), PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  fallback_ = Fallback::never;
  context_->newton.iterate_to_rounding(false);
  PetscCall(solve_from(y, good));
  context_->newton.iterate_to_rounding(true);
  fallback_ = other_ ? Fallback::never : Fallback::late;
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(TSSetTimeStep(ts_, of_loads));
  PetscFunctionReturn(0);
}

PetscErrorCode PseudoTime::continue_from_start(SNES snes) {
  constexpr PetscInt MOST = 500;
  constexpr double PART = 1;
  PetscInt most = 0;
  PC pc;
  Vec y, X;
  SNESConvergedReason reason;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(VecCopy(y, X));
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(condensed_renew(pc));
  PetscCall(SNESGetTolerances(snes, nullptr, nullptr, nullptr, &most, nullptr));
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, MOST, PETSC_DEFAULT));
  context_->newton.allow_all_iterations(true);
  model_->set_pseudo_time(PART);
  model_->begin_solve();
  snes->vec_func_init_set = PETSC_FALSE;
  PetscCall(newton_(snes));
  model_->set_pseudo_time(0);
  context_->newton.allow_all_iterations(false);
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, most, PETSC_DEFAULT));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  if (reason > 0) ++solves_;
  PetscCall(condensed_renew(pc));
  PetscFunctionReturn(0);
}

namespace {

/// A stage of `ts` that counts as solved for, whatever y is: its residual knows where the step starts and how long it is.
PetscErrorCode make_stage(TS ts, TSContext& context, double h, Vec y) {
  Replay stage;
  PetscFunctionBegin;
  const auto examine = std::exchange(context.examine, nullptr);
  PetscCall(stage.begin(ts));
  PetscCall(stage.step(0, h, y, nullptr, y));
  PetscCall(stage.end(0, h));
  context.examine = examine;
  PetscFunctionReturn(0);
}

PetscErrorCode copy_velocities(Vec from, Vec to) {
  PetscFunctionBegin;
  const ReadArray a(from);
  const WriteArray b(to);
  layout_of(to).for_each([&](PetscInt, PetscInt v) { b[v] = a[v]; });
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode RestStart::find(TS ts, TSContext& context, Equilibrium& model, PseudoTime& solver) {
  Vec y;
  VecHandle given;
  HeldEnergies had;
  PetscReal h;
  PetscInt before = 0, after = 0;
  PC pc;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(VecDuplicate(y, given.out()));
  PetscCall(VecCopy(y, given));
  model.set_factor(0);
  PetscCall(model.energies(0, y, &had));  // a box whose strains are free is another afterwards
  PetscCall(make_stage(ts, context, h, y));
  PetscCall(context.newton.estimate_floor(1 / h));
  PetscCall(TSGetSNESIterations(ts, &before));
  PetscCall(solver.relax(y, &found_));
  PetscCall(TSGetSNESIterations(ts, &after));
  tried_ = true;
  iterations_ = after - before;
  if (found_) {
    PetscCall(copy_velocities(given, y));
    PetscCall(model.begin_at(0, y, had));
  }
  // the first load step begins as if nothing had been
  model.set_trouble("");
  context.newton.forget_lengths();
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_renew(pc));
  PetscFunctionReturn(0);
}

void RestStart::count(std::vector<Tally>* out) const {
  out->push_back({"start_newton",
                  found_ ? "Newton iterations brought the lattice, as it was given, to rest at the load factor 0"
                         : "Newton iterations looked in vain for an equilibrium at the load factor 0",
                  iterations_});
}

PetscErrorCode RestStart::warn(Warnings* warnings) const {
  PetscFunctionBegin;
  if (!tried_ || found_) PetscFunctionReturn(0);
  PetscCall(
      warnings->add("start_not_at_rest",
                    "no equilibrium of the lattice was found at the load factor 0: the first load step starts from the lattice as it is given, and "
                    "what it releases is in no sum of energies"));
  PetscFunctionReturn(0);
}

void RestStart::save(Facts* facts) const {
  facts->whole["start_tried"] = tried_ ? 1 : 0;
  facts->whole["start_at_rest"] = found_ ? 1 : 0;
}

void RestStart::restore(const Facts& facts) {
  tried_ = facts.whole_of("start_tried") != 0;
  found_ = facts.whole_of("start_at_rest") != 0;
}

}  // namespace bs
