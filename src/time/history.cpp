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
  used_ = step;
  if (kind_ == Kind::bdf && steps_ == 0 && time < start + 0.75 * step) PetscCall(copy(stage, &half_));
  PetscFunctionReturn(0);
}

PetscErrorCode History::end_step(TS ts) {
  PetscFunctionBegin;
  past_.back().step = used_;
  if (kind_ == Kind::acceleration) {
    KeptAcceleration* own;
    PetscCall(kept_acceleration(ts, &own));
    kept_ = own->kept;
  }
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
