#include "tasks/statics/arc_length.hpp"
#include <cmath>
#include "base/collective.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/own_solve.hpp"
#include "time/methods.hpp"

namespace bs {
PetscErrorCode ArcLength::attach(TS ts, TSContext& context, Equilibrium& model, PseudoTime& start, const ArcPath& path) {
  SNES snes;
  PC pc;
  PetscFunctionBegin;
  ts_ = ts;
  context_ = &context;
  model_ = &model;
  start_solver_ = &start;
  path_ = path;
  model.begin_path(path.end);
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_demand(pc, &of_start_));
  // S itself is solved with, definite or not
  of_start_.inertia = of_path_.inertia = true;
  PetscCall(condensed_set_tangent(pc, model.tangent(), of_path_));
  context.newton.allow_all_iterations(true);
  for (VecHandle* vec : {&start_, &tangent_, &way_, &q_, &zq_, &zf_}) PetscCall(VecDuplicate(model.initial_state(), vec->out()));
  PetscCall(attach_own_solve(snes, this));
  PetscFunctionReturn(0);
}

/// Of positions, divided by X^2.
PetscErrorCode ArcLength::product(Vec a, Vec b, double* value) const {
  double sum = 0;
  PetscFunctionBegin;
  const ReadArray pa(a), pb(b);
  layout_of(a).for_each([&](PetscInt x, PetscInt) { sum += pa[x] * pb[x]; });
  PetscCall(sum_over_ranks(model_->comm(), &sum));
  *value = sum / (scale_ > 0 ? scale_ : 1);
  PetscFunctionReturn(0);
}

/// X += part z in its positions, whose velocities follow; s += ds.
PetscErrorCode ArcLength::update(Vec X, Vec z, double part, double ds) {
  PetscReal h;
  PetscFunctionBegin;
  PetscCall(TSGetTimeStep(ts_, &h));
  const ReadArray az(z), a0(start_);
  const WriteArray a(X);
  layout_of(X).for_each([&](PetscInt x, PetscInt v) {
    a[x] += part * az[x];
    a[v] = (a[x] - a0[x]) / h;
  });
  now_ += ds;
  model_->set_factor(now_);
  PetscFunctionReturn(0);
}

/// A new step starts where the last one ended, a repeated one where that one started.
PetscErrorCode ArcLength::begin(SNES snes, Vec X) {
  Vec y;
  PetscReal t;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts_, &t));
  PetscCall(TSGetSolution(ts_, &y));
  repeated_ = t == from_;
  if (!repeated_) {
    if (from_ >= 0) {
      PetscCall(VecWAXPY(way_, -1.0, start_, y));
      way_s_ = now_ - start_factor_;
      has_way_ = true;
    }
    start_factor_ = now_;
    PetscCall(VecCopy(y, start_));
    from_ = t;
  }
  now_ = start_factor_;
  model_->set_factor(now_);
  model_->begin_solve();
  PetscCall(VecCopy(start_, X));
  snes->iter = 0;
  snes->linear_its = 0;
  snes->reason = SNES_CONVERGED_ITERATING;
  PetscFunctionReturn(0);
}

/// The tangent at X, z_q, and z_f where F is given.
PetscErrorCode ArcLength::linear_solves(SNES snes, Vec X, Vec F, bool* solved) {
  KSP ksp;
  KSPConvergedReason reason;
  PetscReal t;
  PetscFunctionBegin;
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(SNESComputeJacobian(snes, X, snes->jacobian, snes->jacobian_pre));
  PetscCall(KSPSetOperators(ksp, snes->jacobian, snes->jacobian_pre));
  PetscCall(TSGetTime(ts_, &t));
  PetscCall(model_->load_direction(t, X, q_));
  PetscCall(KSPSolve(ksp, q_, zq_));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  *solved = reason > 0;
  if (F && *solved) {
    PetscCall(KSPSolve(ksp, F, zf_));
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    *solved = reason > 0;
  }
  PetscFunctionReturn(0);
}

// The direction is that in which the last step went; the first one raises the load, or lowers it where that is asked for.
PetscErrorCode ArcLength::predict(SNES snes, Vec X, bool* solved) {
  double square = 0, along = path_.lower ? -1 : 1;
  PetscReal h;
  PetscFunctionBegin;
  PetscCall(linear_solves(snes, X, nullptr, solved));
  if (!*solved) PetscFunctionReturn(0);
  PetscCall(product(zq_, zq_, &square));
  if (scale_ == 0 && square > 0) {
    scale_ = square;
    square = 1;
  }
  if (has_way_) {
    PetscCall(product(way_, zq_, &along));
    along += way_s_;
  }
  tangent_s_ = (along < 0 ? -1 : 1) / std::sqrt(square + 1);
  PetscCall(VecCopy(zq_, tangent_));
  PetscCall(VecScale(tangent_, tangent_s_));
  PetscCall(TSGetTimeStep(ts_, &h));
  length_ = std::sqrt(2.0) * h;
  const double left = path_.end - start_factor_;
  to_end_ = left * tangent_s_ > 0 && std::abs(length_ * tangent_s_) >= std::abs(left) * (1 - 1e-9);
  if (to_end_) length_ = left / tangent_s_;
  PetscCall(update(X, tangent_, length_, length_ * tangent_s_));
  if (to_end_) {
    now_ = path_.end;
    model_->set_factor(now_);
  }
  PetscFunctionReturn(0);
}

/// One correction; `reason` of the SNES where it cannot be made.
PetscErrorCode ArcLength::correct(SNES snes, Vec X, Vec F) {
  bool solved = false;
  double of_f = 0, of_q = 0, change = 0;
  PetscFunctionBegin;
  PetscCall(linear_solves(snes, X, F, &solved));
  if (!solved) {
    snes->reason = SNES_DIVERGED_LINEAR_SOLVE;
    PetscFunctionReturn(0);
  }
  if (!to_end_) {
    PetscCall(product(tangent_, zf_, &of_f));
    PetscCall(product(tangent_, zq_, &of_q));
    change = of_f / (of_q + tangent_s_);
  }
  if (!std::isfinite(change)) {
    snes->reason = SNES_DIVERGED_LINEAR_SOLVE;
    PetscFunctionReturn(0);
  }
  PetscCall(update(X, zf_, -1, 0));
  PetscCall(update(X, zq_, change, change));
  PetscFunctionReturn(0);
}

/// An equilibrium at the present load factor, by what serves load steps.
PetscErrorCode ArcLength::solve_at_load(SNES snes) {
  PC pc;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(condensed_set_tangent(pc, model_->tangent(), of_start_));
  PetscCall(start_solver_->solve(snes));
  PetscCall(condensed_set_tangent(pc, model_->tangent(), of_path_));
  PetscFunctionReturn(0);
}

/// A first step whose corrections have failed, as where a flat net has no stiffness before its load: the load is given, and the way that it leads
/// takes the tangent's place in X.
PetscErrorCode ArcLength::raise_load(SNES snes, Vec X) {
  PetscReal h;
  double square = 0;
  PetscFunctionBegin;
  PetscCall(TSGetTimeStep(ts_, &h));
  const double left = path_.end - start_factor_, change = path_.lower ? -h : h;
  to_end_ = left * change > 0 && std::abs(change) >= std::abs(left) * (1 - 1e-9);
  now_ = to_end_ ? path_.end : start_factor_ + change;
  model_->set_factor(now_);
  PetscCall(solve_at_load(snes));
  arrived_ = snes->reason > 0 && to_end_;
  if (snes->reason <= 0) PetscFunctionReturn(0);
  PetscCall(VecWAXPY(way_, -1.0, start_, X));
  scale_ = 0;
  PetscCall(product(way_, way_, &square));
  scale_ = square / ((now_ - start_factor_) * (now_ - start_factor_));
  PetscFunctionReturn(0);
}

PetscErrorCode ArcLength::solve(SNES snes) {
  constexpr PetscInt MOST = 15;
  Vec X = snes->vec_sol, F = snes->vec_func;
  bool solved = false;
  double first = 0;
  PetscReal size = 0, xnorm = 0, load = 0;
  PetscFunctionBegin;
  if (!start_solver_->at_load_step()) {
    PetscCall(solve_at_load(snes));
    PetscFunctionReturn(0);
  }
  PetscCall(begin(snes, X));
  if (repeated_ && !has_way_) {
    PetscCall(raise_load(snes, X));
    PetscFunctionReturn(0);
  }
  PetscCall(predict(snes, X, &solved));
  if (!solved) snes->reason = SNES_DIVERGED_LINEAR_SOLVE;
  PetscCall(VecNorm(q_, NORM_2, &load));
  context_->newton.set_reference({0, load * std::max(std::abs(now_), path_.step)});
  for (PetscInt it = 0; snes->reason == SNES_CONVERGED_ITERATING; ++it) {
    PetscCall(SNESComputeFunction(snes, X, F));
    PetscCall(VecNorm(F, NORM_2, &size));
    PetscCall(VecNorm(X, NORM_2, &xnorm));
    snes->iter = it;
    snes->norm = size;
    PetscCall(SNESMonitor(snes, it, size));
    PetscUseTypeMethod(snes, converged, it, xnorm, xnorm, size, &snes->reason, snes->cnvP);
    if (it == 0) first = size;
    if (snes->reason == SNES_CONVERGED_ITERATING && size > 1e6 * std::max(first, load * path_.step)) snes->reason = SNES_DIVERGED_DTOL;
    if (snes->reason == SNES_CONVERGED_ITERATING && it == MOST) snes->reason = SNES_DIVERGED_MAX_IT;
    if (snes->reason == SNES_CONVERGED_ITERATING) PetscCall(correct(snes, X, F));
  }
  arrived_ = snes->reason > 0 && to_end_;
  PetscFunctionReturn(0);
}

}  // namespace bs
