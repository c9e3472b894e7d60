#include "time/implicit/substep_guess.hpp"
#include <algorithm>
#include "base/collective.hpp"
#include "base/log_event.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "systems/layout.hpp"
#include "systems/mechanics.hpp"
#include "time/methods.hpp"

namespace bs {
namespace {

constexpr double FINER = 4;    // sub-steps in theta h: 8 and 16 leave more Newton iterations, 2 more linear ones
constexpr double LOOSE = 0.1;  // of the linear solves: 0.01 takes as many Newton iterations and more linear ones

}  // namespace

void SubstepGuess::attach(TS ts, Model& model, double theta, PetscInt most) {
  ts_ = ts;
  model_ = &model;
  theta_ = theta;
  most_ = most;
}

PetscErrorCode SubstepGuess::missing(TS ts, Model& model, const char** why) {
  PC pc;
  SNES snes;
  CondensedDemand demand;
  PetscInt lag = 1;
  PetscFunctionBegin;
  *why = "";
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_demand(pc, &demand));
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetLagJacobian(snes, &lag));
  if (!model.tangent() || !model.incremental() || !demand.direction) *why = "the line search energy and -pc_type condensed";
  else if (!model.tangent()->has_inertia()) *why = "steps in time, not load steps";
  else if (lag != 1) *why = "-snes_lag_jacobian 1";  // a Jacobian that is kept would be that of the last sub-step
  PetscFunctionReturn(0);
}

PetscErrorCode SubstepGuess::begin(Vec y, Vec X) {
  PetscReal t, h;
  PetscFunctionBegin;
  for (VecHandle* room : {&here_, &there_, &line_, &F_})
    if (!*room) PetscCall(VecDuplicate(y, room->out()));
  PetscCall(TSGetTime(ts_, &t));
  PetscCall(TSGetTimeStep(ts_, &h));
  end_ = t + h;
  sigma_ = 1 / (theta_ * h);
  PetscCall(VecCopy(y, here_));
  PetscCall(add_kinematic(y, here_));
  PetscCall(VecCopy(here_, X));
  const ReadArray a(y);
  u_.clear();
  layout_of(y).for_each([&](PetscInt, PetscInt v) { u_.push_back(a[v]); });
  PetscFunctionReturn(0);
}

/// The velocity at which F_x vanishes: v = sigma (x - x_n) - (1 - theta)/theta v_n
PetscErrorCode SubstepGuess::add_kinematic(Vec y, Vec z) const {
  PetscFunctionBegin;
  const ReadArray start(y);
  const WriteArray a(z);
  layout_of(z).for_each([&](PetscInt x, PetscInt v) { a[v] = sigma_ * (a[x] - start[x]) - (1 - theta_) / theta_ * start[v]; });
  PetscFunctionReturn(0);
}

/// there_ from here_ and u_.
PetscErrorCode SubstepGuess::step(SNES snes, Vec y, bool* solved) {
  const double s = FINER * sigma_;
  Mat P;
  PC pc;
  PetscFunctionBegin;
  PetscCall(VecCopy(here_, there_));
  {
    const WriteArray a(there_);
    std::size_t k = 0;
    layout_of(y).for_each([&](PetscInt x, PetscInt) { a[x] += u_[k++] / s; });
  }
  PetscCall(add_kinematic(y, there_));
  PetscCall(SNESComputeFunction(snes, there_, F_));
  {
    const WriteArray r(F_);
    layout_of(y).for_each([&](PetscInt x, PetscInt) { r[x] = 0; });
  }
  PetscCall(SNESGetJacobian(snes, nullptr, &P, nullptr, nullptr));
  PetscCall(model_->jacobian(end_, there_, F_, s, Form::momentum, P));
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(condensed_solve_definite(pc, LOOSE, F_, line_, solved));
  ++taken_;
  if (!*solved) PetscFunctionReturn(0);
  {
    const ReadArray w(line_), from(here_);
    const WriteArray a(there_);
    std::size_t k = 0;
    layout_of(y).for_each([&](PetscInt x, PetscInt v) {
      u_[k] -= w[v];
      a[x] = from[x] + u_[k++] / s;
    });
  }
  PetscCall(add_kinematic(y, there_));
  PetscFunctionReturn(0);
}

/// Of Phi from here_ to there_ [W]; not finite where a force has no value.
PetscErrorCode SubstepGuess::change_of_potential(SNES snes, double* change) {
  double slope = 0;
  PotentialChange beyond;
  PetscFunctionBegin;
  PetscCall(SNESComputeFunction(snes, here_, F_));
  PetscCall(VecWAXPY(line_, -1.0, here_, there_));
  {
    const ReadArray f(F_);
    const WriteArray a(line_);
    layout_of(line_).for_each([&](PetscInt x, PetscInt v) {
      a[x] = a[v] / sigma_;
      slope += f[v] * a[v];
    });
  }
  PetscCall(sum_over_ranks(model_->comm(), &slope));
  PetscCall(model_->incremental()->follow(here_, line_));
  PetscCall(model_->incremental()->beyond_slope(end_, sigma_, 1, &beyond));
  *change = slope + beyond.value;
  PetscFunctionReturn(0);
}

// Phi is counted from its lowest value so far.
PetscErrorCode SubstepGuess::descend(SNES snes, Vec y, Vec X) {
  bool rested = false;
  PetscFunctionBegin;
  for (PetscInt k = 0; k < most_; ++k) {
    bool solved = false;
    double change = 0;
    PetscCall(step(snes, y, &solved));
    if (!solved) break;
    PetscCall(change_of_potential(snes, &change));
    const bool lower = change < 0;
    if (!lower && rested) break;  // the next one would be the same
    rested = !lower;
    if (lower) {
      PetscCall(VecCopy(there_, here_));
      PetscCall(VecCopy(there_, X));
    } else {
      std::fill(u_.begin(), u_.end(), 0.0);
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SubstepGuess::make(SNES snes, Vec y, Vec X) {
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::guess, snes);
  PetscCall(begin(y, X));
  PetscCall(descend(snes, y, X));
  PetscFunctionReturn(0);
}

}  // namespace bs
