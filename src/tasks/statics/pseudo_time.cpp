#include "tasks/statics/pseudo_time.hpp"
#include <algorithm>
#include <cmath>
#include <utility>
#include "base/handle.hpp"
#include "base/petsc_versions.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/own_solve.hpp"
#include "time/methods.hpp"
#include "time/own_type.hpp"

namespace bs {

/// Of the linear solves; linear solves of one call at most; the smallest shift, by the mean squared frequency.
static constexpr double LINEAR_RTOL = 1e-6, LEAST = 1e-10;
static constexpr PetscInt MOST = 1000;

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
  continued_ = false;
  minimum_.at.reset();
  model_->begin_solve();
  PetscCall(newton_(snes));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  if (fallback_ == Fallback::never) PetscFunctionReturn(0);
  if (reason < 0) {
    PetscCall(TSGetTimeStep(ts_, &h));
    PetscCall(TSGetTime(ts_, &from));
    if (fallback_ == Fallback::late && from == tried_ && h > SHORT * nominal_) PetscFunctionReturn(0);
    tried_ = from;
    Vec y;
    PetscCall(TSGetSolution(ts_, &y));
    PetscCall(make_room(y));
    PetscCall(VecCopy(y, at_));
    PetscCall(zero_velocities(at_));
    PetscCall(continue_from(snes));
    if (snes->reason > 0) ++solves_;
  }
  if (minima_ && snes->reason > 0) PetscCall(leave_saddles(snes));
  if (ended_by_itself(snes->reason)) PetscCall(balance_better(snes));
  PetscFunctionReturn(0);
}

PetscErrorCode PseudoTime::make_room(Vec y) {
  PetscFunctionBegin;
  for (VecHandle* room : {&at_, &correction_, &saddle_, &direction_})
    if (!*room) PetscCall(VecDuplicate(y, room->out()));
  PetscFunctionReturn(0);
}

/// Of the stage that is solved for: a load step's end, or where a search aside from them stands.
PetscErrorCode PseudoTime::time_of_loads(double* t) {
  PetscReal now, h;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts_, &now));
  PetscCall(TSGetTimeStep(ts_, &h));
  *t = between_load_steps_ ? now : now + h;
  PetscFunctionReturn(0);
}

// The stage of the last step is solved again: its residual does not depend on where the step came from. Newton starts at y, not where the
// predictor would.
PetscErrorCode PseudoTime::solve_from(Vec y, Fallback fallback, bool* good) {
  SNES snes;
  SNESConvergedReason reason;
  PetscReal time;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts_, &snes));
  PetscCall(copy_into(&room_, y));
  const auto guess = snes->ops->computeinitialguess;
  snes->ops->computeinitialguess = nullptr;
  fallback_ = other_ ? Fallback::never : fallback;
  between_load_steps_ = true;
  PetscCall(SNESSolve(snes, nullptr, room_));
  between_load_steps_ = false;
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
  fallback_ = other_ ? Fallback::never : Fallback::late;
  if (*good) PetscCall(VecCopy(room_, y));
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
  context_->newton.iterate_to_rounding(false);
  PetscCall(solve_from(y, Fallback::never, good));
  context_->newton.iterate_to_rounding(true);
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(TSSetTimeStep(ts_, of_loads));
  PetscFunctionReturn(0);
}

PetscErrorCode PseudoTime::linear_solve(SNES snes, Vec X, Vec z, bool* good, bool* definite) {
  KSP ksp;
  PC pc;
  KSPConvergedReason reason;
  CondensedCounts before, after;
  PetscInt iterations = 0;
  PetscReal rtol = 0;
  bool is = false;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts_, &ksp, &pc));
  PetscCall(SNESComputeJacobian(snes, X, snes->jacobian, snes->jacobian_pre));
  PetscCall(KSPSetOperators(ksp, snes->jacobian, snes->jacobian_pre));
  PetscCall(KSPGetTolerances(ksp, &rtol, nullptr, nullptr, nullptr));
  PetscCall(KSPSetTolerances(ksp, LINEAR_RTOL, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(condensed_counts(pc, &is, &before));
  PetscCall(KSPSolve(ksp, snes->vec_func, z));
  PetscCall(KSPSetTolerances(ksp, rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(condensed_counts(pc, &is, &after));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetIterationNumber(ksp, &iterations));
  krylov_ += iterations;
  ++newton_steps_;
  *good = reason > 0;
  *definite = after.indefinite == before.indefinite;
  PetscFunctionReturn(0);
}

// Newton's method for M (x - x_n)/h^2 = f(x), from x_n, with tensions predicted for every correction. Its residual may rise by orders of magnitude on
// the way, since bars that turn are strained at first: no line search could allow that, nor is one needed.
PetscErrorCode PseudoTime::step(SNES snes, double h, Vec start, Vec X, PetscInt* corrections, bool* good) {
  constexpr PetscInt LONGEST = 12, EARLY = 4;
  constexpr double CLOSE = 0.1, TURN = 0.5;
  double left = 0, inertia = 0, before[2] = {0, 0}, part = 1;
  bool solved = true, definite = true;
  Linearisation& lin = model_->mechanics()->linearisation();
  PetscFunctionBegin;
  PetscCall(VecCopy(start, X));
  PetscCall(model_->set_motion(h, start));
  for (*corrections = 0, *good = false; !*good; ++*corrections) {
    const PetscInt k = *corrections;
    PetscCall(SNESComputeFunction(snes, X, snes->vec_func));
    PetscCall(model_->step_forces(X, snes->vec_func, &left, &inertia));
    *good = k > 0 && left <= std::max(CLOSE * inertia, context_->newton.floor()[1]);
    if (*good || !std::isfinite(left) || k == LONGEST || (k >= EARLY && left > before[0])) break;
    before[0] = std::exchange(before[1], left);
    PetscCall(linear_solve(snes, X, correction_, &solved, &definite));
    if (!solved || (k == 0 && !definite)) break;
    PetscCall(VecScale(correction_, -1));
    PetscCall(lin.predict_tensions(correction_, TURN, &part));
    PetscCall(VecAXPY(X, part, correction_));
  }
  lin.forget_tensions();
  domain_error(snes) = PETSC_FALSE;
  PetscFunctionReturn(0);
}

/// Whether X, at the loads of the stage, has no more energy than `start`.
PetscErrorCode PseudoTime::falls(Vec start, Vec X, bool* yes) {
  HeldEnergies here, there;
  double t = 0;
  PetscFunctionBegin;
  PetscCall(time_of_loads(&t));
  PetscCall(model_->energies(t, start, &here));
  PetscCall(model_->energies(t, X, &there));
  *yes = there.potential <= here.potential + here.rounding + there.rounding;
  PetscFunctionReturn(0);
}

// The shift 1/h^2 falls as long as few corrections bring a step to its end, and rises where they do not, or a curvature below -1/h^2 shows.
PetscErrorCode PseudoTime::descend(SNES snes, double goal, Vec at, Vec X) {
  constexpr double GREATEST = 1e6, RISE = 8;
  const double rate = model_->mean_squared_frequency();
  PetscFunctionBegin;
  while (newton_steps_ < MOST && shift_ < GREATEST) {
    PetscInt corrections = 0;
    bool good = false;
    double left = 0, inertia = 0;
    const double h = 1 / std::sqrt(shift_ * rate);
    PetscCall(step(snes, h, at, X, &corrections, &good));
    if (good) PetscCall(falls(at, X, &good));
    if (!good) {
      shift_ = std::max(RISE * shift_, LEAST);
      continue;
    }
    PetscCall(zero_velocities(X));
    PetscCall(VecCopy(X, at));
    shift_ = std::max(shift_ * (corrections <= 3 ? 1.0 / 16 : corrections <= 5 ? 0.25 : corrections <= 7 ? 0.5 : 1), LEAST);
    PetscCall(model_->set_motion(h, at));
    PetscCall(SNESComputeFunction(snes, at, snes->vec_func));
    PetscCall(model_->step_forces(at, snes->vec_func, &left, &inertia));
    PetscCall(SNESMonitor(snes, newton_steps_, left));
    if (left <= std::max(goal, context_->newton.floor()[1])) break;
  }
  PetscFunctionReturn(0);
}

// From at_.
PetscErrorCode PseudoTime::continue_from(SNES snes) {
  constexpr PetscInt AT_END = 30;
  constexpr double FIRST = 1e-3, FALL = 1e-6, NEARER = 1e-3;
  PetscInt most = 0, iterations = snes->iter, krylov = snes->linear_its;  // those that led nowhere count, too
  double first = 0, inertia = 0;
  PC pc;
  Vec X;
  PetscFunctionBegin;
  if (model_->mean_squared_frequency() == 0) PetscFunctionReturn(0);  // there was no linearisation
  continued_ = true;
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(condensed_renew(pc));
  PetscCall(SNESGetTolerances(snes, nullptr, nullptr, nullptr, &most, nullptr));
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, AT_END, PETSC_DEFAULT));
  context_->newton.allow_all_iterations(true);
  newton_steps_ = krylov_ = 0;
  shift_ = FIRST;
  PetscCall(model_->set_motion(1, at_));
  PetscCall(SNESComputeFunction(snes, at_, snes->vec_func));
  PetscCall(model_->step_forces(at_, snes->vec_func, &first, &inertia));
  for (double goal = FALL * first; newton_steps_ < MOST; goal *= NEARER) {
    const PetscInt before = newton_steps_;
    PetscCall(descend(snes, goal, at_, X));
    PetscCall(model_->set_motion(0, at_));
    PetscCall(VecCopy(at_, X));
    model_->begin_solve();
    snes->vec_func_init_set = PETSC_FALSE;
    PetscCall(newton_(snes));
    iterations += snes->iter;
    krylov += snes->linear_its;
    if (snes->reason > 0 || newton_steps_ == before) break;
  }
  snes->iter = iterations + newton_steps_;
  snes->linear_its = krylov + krylov_;
  context_->newton.allow_all_iterations(false);
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, most, PETSC_DEFAULT));
  PetscCall(condensed_renew(pc));
  PetscFunctionReturn(0);
}

void PseudoTime::count(std::vector<Tally>* out) const {
  out->push_back({"pseudo_transient",
                  "load step{s} ended by pseudo-transient continuation, where Newton's method had failed: the shape may have jumped", solves_});
  out->push_back({"saddle_points",
                  "solve{s} that found {a saddle point|saddle points} of the energy, and went on downhill from there (-bs_equilibria)", saddles_});
}

void PseudoTime::save(Facts* facts) const {
  facts->whole["pseudo_transient"] = solves_;
  facts->whole["saddle_points"] = saddles_;
}

void PseudoTime::restore(const Facts& facts) {
  solves_ = facts.whole_of("pseudo_transient", solves_);
  saddles_ = facts.whole_of("saddle_points", saddles_);
}

}  // namespace bs
