#include "time/history.hpp"
#include <algorithm>
#include "base/error.hpp"
#include "time/methods.hpp"
#include "time/starter.hpp"

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
  if (!starter_.active() && in_starting_procedure()) PetscCall(starter_.begin(ts, static_cast<PetscInt>(depth_)));
  PetscFunctionReturn(0);
}

PetscErrorCode History::record_stage(TS ts, PetscReal time, Vec stage) {
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
  if (starter_.active() && !in_starting_procedure()) PetscCall(starter_.end());
  PetscFunctionReturn(0);
}

void History::forget() {
  past_.clear();
  half_ = {};
  steps_ = 0;
}

bool History::in_starting_procedure() const { return kind_ == Kind::bdf && depth_ > 2 && steps_ + 2 < static_cast<std::int64_t>(depth_); }

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
  if (kept_) states->push_back({"/history/acceleration", kept_});
}

PetscErrorCode History::restore(TS ts, Model& model, const Checkpoint& file, std::string* missing) {
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  const Facts& run = file.run();
  const std::int64_t kept = run.whole_of("history_states");
  steps_ = run.whole_of("history_steps");
  const bool missed = steps_ > 0 || run.whole.count("history_steps") == 0;  // a method at its start remembers nothing
  past_.clear();
  for (std::int64_t k = std::max<std::int64_t>(0, kept - static_cast<std::int64_t>(depth_)); k < kept; ++k) {
    const std::string name = "history_" + std::to_string(k);
    Past one;
    one.time = run.real_of(name + "_time");
    one.step = run.real_of(name + "_step");
    PetscCall(VecDuplicate(y, one.state.out()));
    PetscCall(file.read(model, "/history/" + std::to_string(k), one.state));
    past_.push_back(std::move(one));
  }
  if (file.has("/history/half")) {
    PetscCall(VecDuplicate(y, half_.out()));
    PetscCall(file.read(model, "/history/half", half_));
  }
  if (kind_ == Kind::acceleration && missed) PetscCall(restore_acceleration(ts, model, file, missing));
  if (kind_ == Kind::bdf && missed && past_.size() < depth_ && !half_)
    *missing =
        "the checkpoint holds " + how_many(static_cast<std::int64_t>(past_.size()), "state") + format(" before the last, bdf needs %zu", depth_);
  if (!missing->empty() || past_.empty()) {
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
PetscErrorCode History::restore_acceleration(TS ts, Model& model, const Checkpoint& file, std::string* missing) {
  KeptAcceleration* own;
  PetscFunctionBegin;
  if (!file.has("/history/acceleration")) {
    *missing = "the checkpoint lacks the acceleration that the method carries from step to step";
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
    PetscCall(replay.step(past_[k].time, past_[k].step, past_[k].state, first && kind_ == Kind::bdf ? half : nullptr, end));
  }
  PetscCall(replay.end(time, step));
  PetscFunctionReturn(0);
}

}  // namespace bs
