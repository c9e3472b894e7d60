#include "time/history.hpp"
#include <algorithm>
#include "base/fault.hpp"
#include "time/kept_acceleration.hpp"
#include "time/ts_queries.hpp"

namespace bs {

PetscErrorCode History::attach(TS ts) {
  const Method* method;
  PetscFunctionBegin;
  PetscCall(method_of(ts, &method));
  kind_ = method->traits->memory;
  if (kind_ == Kind::bdf) {
    PetscInt order;
    PetscCall(TSBDFGetOrder(ts, &order));
    depth_ = static_cast<std::size_t>(order);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode History::copy(Vec from, VecHandle* to) const {
  PetscFunctionBegin;
  if (!*to) PetscCall(VecDuplicate(from, to->out()));
  PetscCall(VecCopy(from, *to));
  PetscFunctionReturn(0);
}

PetscErrorCode History::begin_step(TS ts) {
  Vec y;
  PetscReal time, step;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTime(ts, &time));
  PetscCall(TSGetTimeStep(ts, &step));
  Past next;
  if (open_) {
    next.state = std::move(past_.back().state);
    past_.pop_back();
  } else if (past_.size() == depth_ + 1) {
    next.state = std::move(past_.front().state);
    past_.erase(past_.begin());
  }
  next.time = time;
  next.step = used_ = step;
  PetscCall(copy(y, &next.state));
  past_.push_back(std::move(next));
  open_ = true;
  if (!starter_.active() && starts_accurately()) PetscCall(starter_.begin(ts, static_cast<PetscInt>(depth_)));
  PetscFunctionReturn(0);
}

PetscErrorCode History::see_stage(TS ts, PetscReal time, Vec stage) {
  PetscReal step, start;
  PetscFunctionBegin;
  if (replaying_) PetscFunctionReturn(0);
  PetscCall(TSGetTimeStep(ts, &step));
  PetscCall(TSGetTime(ts, &start));
  if (kind_ == Kind::alpha) {
    bool starting = false;
    PetscCall(is_alpha_starting(ts, &starting));
    if (!starting) used_ = step;
    else if (time < start + 1.5 * step) PetscCall(copy(stage, &half_));  // `step` is half of the step here
    else PetscCall(copy(stage, &second_));
    if (!starting) {
      PetscCall(settle_rate(ts));
      PetscFunctionReturn(0);
    }
    if (time < start + 1.5 * step) first_half_ = stage;
    else PetscCall(correct_start(stage));
    PetscFunctionReturn(0);
  }
  used_ = step;
  if (kind_ == Kind::bdf && steps_ == 0 && time < start + 0.75 * step) PetscCall(copy(stage, &half_));
  PetscFunctionReturn(0);
}

// PETSc's alpha starts with V0 = (-3 y0 + 4 a - b)/(h/2) from a = y(h/2), b = y(h) by backward Euler: twice dy/dt, which
// leaves order 1, and 0 on algebraic equations, wherever V0 matters (a spectral radius below 1). It gets, in the places of a
// and b, what gives V0 = (-3 y0 + 4 a - b)/h and the same second difference, from which it estimates its error:
//   a' = (3 y0 + b)/4,   b' = (3 y0 - 4 a + 3 b)/2
PetscErrorCode History::correct_start(Vec second) {
  Vec y0 = past_.back().state;
  PetscFunctionBegin;
  PetscCall(VecAXPBYPCZ(first_half_, 0.75, 0.25, 0, y0, second_));
  PetscCall(VecAXPBYPCZ(second, 1.5, -2, 1.5, y0, half_));
  first_half_ = nullptr;
  PetscFunctionReturn(0);
}

// alpha computes V1 along with the residual. SNES ksponly evaluates none at its solution, so that V1 would be that of its guess.
PetscErrorCode History::settle_rate(TS ts) {
  SNES snes;
  Vec y;
  PetscBool once = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESKSPONLY, &once));
  if (!once) PetscFunctionReturn(0);
  PetscCall(SNESGetSolution(snes, &y));
  if (!residual_) PetscCall(VecDuplicate(y, residual_.out()));
  PetscCall(SNESComputeFunction(snes, y, residual_));
  PetscFunctionReturn(0);
}

// V1 = (y1 - y0)/(gamma h) + (1 - 1/gamma) V0, in the order of PETSc's own operations; at the start
// V0 = (-3 y0 + 4 y(h/2) - y(h))/h from the two half steps.
PetscErrorCode History::advance_rate(TS ts, Vec y) {
  PetscReal gamma;
  Vec y0 = last_start();
  PetscFunctionBegin;
  PetscCall(TSAlphaGetParams(ts, nullptr, nullptr, &gamma));
  if (!rate_) PetscCall(VecDuplicate(y, rate_.out()));
  if (!rate0_) PetscCall(VecDuplicate(y, rate0_.out()));
  if (steps_ == 0 && half_ && second_) {
    PetscCall(VecZeroEntries(rate0_));
    PetscCall(VecAXPY(rate0_, -3 / used_, y0));
    PetscCall(VecAXPY(rate0_, +4 / used_, half_));
    PetscCall(VecAXPY(rate0_, -1 / used_, second_));
  } else {
    PetscCall(VecCopy(rate_, rate0_));
  }
  PetscCall(VecWAXPY(rate_, -1.0, y0, y));
  PetscCall(VecAXPBY(rate_, 1 - 1 / gamma, 1 / (gamma * used_), rate0_));
  PetscFunctionReturn(0);
}

PetscErrorCode History::end_step(TS ts, Vec y) {
  PetscFunctionBegin;
  past_.back().step = used_;
  if (kind_ == Kind::acceleration) {
    KeptAcceleration* own;
    PetscCall(kept_acceleration(ts, &own));
    kept_ = own->kept;
  }
  if (kind_ == Kind::alpha) PetscCall(advance_rate(ts, y));
  ++steps_;
  open_ = false;
  if (starter_.active() && !starts_accurately()) PetscCall(starter_.end());
  PetscFunctionReturn(0);
}

bool History::starts_accurately() const { return kind_ == Kind::bdf && depth_ > 2 && steps_ + 2 < static_cast<std::int64_t>(depth_); }

Vec History::before_last(double* step) const {
  if (!open_ || past_.size() < 2) return nullptr;
  const Past& past = past_[past_.size() - 2];
  *step = past.step;
  return past.state;
}

}  // namespace bs
