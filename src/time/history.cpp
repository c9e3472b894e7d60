#include "time/history.hpp"
#include <algorithm>
#include "base/fault.hpp"
#include "time/kept_acceleration.hpp"
#include "time/replay.hpp"
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

void History::save(Facts* facts, std::vector<NamedState>* states) const {
  const std::size_t done = past_.size() - (open_ ? 1 : 0), first = done > depth_ ? done - depth_ : 0;
  facts->whole["history_states"] = static_cast<std::int64_t>(done - first);
  facts->whole["history_steps"] = steps_;
  for (std::size_t k = first; k < done; ++k) {
    const std::string number = std::to_string(k - first), name = "history_" + number;
    facts->real[name + "_time"] = past_[k].time;
    facts->real[name + "_step"] = past_[k].step;
    states->push_back({"/history/" + number, past_[k].state});
  }
  // the starting procedure of bdf counts until the states that followed have replaced it
  if (kind_ == Kind::bdf && half_ && steps_ < static_cast<std::int64_t>(depth_)) states->push_back({"/history/half", half_});
  if (rate_) states->push_back({"/history/rate", rate_});
  if (kept_) states->push_back({"/history/acceleration", kept_});
}

PetscErrorCode History::restore(TS ts, Model& model, const CheckpointFile& file, std::string* told) {
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  const Facts& run = file.run();
  const auto whole = [&](const char* name) { return run.whole.count(name) ? run.whole.at(name) : 0; };
  const auto real = [&](const std::string& name) { return run.real.count(name) ? run.real.at(name) : 0.0; };
  const std::int64_t kept = whole("history_states");
  steps_ = whole("history_steps");
  past_.clear();
  for (std::int64_t k = std::max<std::int64_t>(0, kept - static_cast<std::int64_t>(depth_)); k < kept; ++k) {
    const std::string name = "history_" + std::to_string(k);
    Past one;
    one.time = real(name + "_time");
    one.step = real(name + "_step");
    PetscCall(VecDuplicate(y, one.state.out()));
    PetscCall(file.read(model, "/history/" + std::to_string(k), one.state));
    past_.push_back(std::move(one));
  }
  for (auto [group, vec] : {std::pair<const char*, VecHandle*>{"/history/half", &half_}, {"/history/rate", &rate_}})
    if (file.has(group)) {
      PetscCall(VecDuplicate(y, vec->out()));
      PetscCall(file.read(model, group, *vec));
    }
  if (kind_ == Kind::acceleration) PetscCall(restore_acceleration(ts, model, file, told));
  if (kind_ == Kind::alpha && !rate_) *told = "the checkpoint lacks the rate that alpha carries from step to step";
  if (kind_ == Kind::bdf && past_.size() < depth_ && !half_)
    *told = format("the checkpoint holds %zu states before the last, bdf needs %zu", past_.size(), depth_);
  if (!told->empty() || past_.empty()) {
    past_.clear();
    steps_ = 0;
    PetscFunctionReturn(0);
  }
  replaying_ = true;
  PetscCall(replay(ts));
  replaying_ = false;
  PetscFunctionReturn(0);
}

/// The type's own vector, as it was.
PetscErrorCode History::restore_acceleration(TS ts, Model& model, const CheckpointFile& file, std::string* told) {
  KeptAcceleration* own;
  PetscFunctionBegin;
  if (!file.has("/history/acceleration")) {
    *told = "the checkpoint lacks the acceleration that the method carries from step to step";
    PetscFunctionReturn(0);
  }
  PetscCall(TSSetUp(ts));
  PetscCall(kept_acceleration(ts, &own));
  PetscCall(file.read(model, "/history/acceleration", own->kept));
  own->known = true;
  kept_ = own->kept;
  PetscFunctionReturn(0);
}

PetscErrorCode History::replay(TS ts) {
  PetscReal time, step;
  Vec y;
  PetscFunctionBegin;
  if (kind_ == Kind::none || kind_ == Kind::acceleration) PetscFunctionReturn(0);
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTime(ts, &time));
  PetscCall(TSGetTimeStep(ts, &step));
  Replay replay;
  PetscCall(replay.begin(ts));
  for (std::size_t k = kind_ == Kind::bdf ? 0 : past_.size() - 1; k < past_.size(); ++k) {
    const bool first = k == 0 || kind_ != Kind::bdf, last = k + 1 == past_.size();
    if (first) PetscCall(TSRestartStep(ts));
    Vec end = last ? replay.present() : past_[k + 1].state.get();
    Vec half = half_ ? half_.get() : past_[k].state.get();
    if (kind_ == Kind::alpha) {
      PetscReal m, f, gamma;
      PetscCall(TSAlphaGetParams(ts, &m, &f, &gamma));
      PetscCall(replay.step_to_rate(past_[k].time, past_[k].step, past_[k].state, gamma * past_[k].step, rate_));
    } else {
      PetscCall(replay.step(past_[k].time, past_[k].step, past_[k].state, first && kind_ == Kind::bdf ? half : nullptr, end));
    }
  }
  PetscCall(replay.end(time, step));
  PetscFunctionReturn(0);
}

}  // namespace bs
