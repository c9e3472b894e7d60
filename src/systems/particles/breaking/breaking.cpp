#include "systems/particles/breaking/breaking.hpp"
#include <algorithm>
#include <limits>
#include <tuple>
#include "base/collective.hpp"

namespace bs {

void Breaking::create(MPI_Comm comm, bool worst, bool with_springs) {
  comm_ = comm;
  rank_ = rank_of(comm);
  worst_ = worst;
  with_springs_ = with_springs;
}

bool Breaking::any() const {
  return sums_.broken > 0 || std::any_of(kinds_.begin(), kinds_.end(), [](const Breakable* kind) { return kind->given_broken(); });
}

/// Keeps, of the parts past their limits on all ranks, only the one with the largest excess; of equal ones the first by kind and row.
PetscErrorCode Breaking::keep_worst(std::vector<PastLimit>* found) const {
  constexpr std::int64_t NONE = std::numeric_limits<std::int64_t>::max();
  double most = 0;
  std::int64_t kind = NONE, row = NONE;
  PetscFunctionBegin;
  for (const PastLimit& one : *found) most = std::max(most, one.excess);
  PetscCall(max_over_ranks(comm_, &most));
  const auto worst = [most](const PastLimit& one) { return one.excess >= most * (1 - BREAK_TIE); };
  for (const PastLimit& one : *found)
    if (worst(one)) kind = std::min<std::int64_t>(kind, one.part.kind);
  PetscCall(min_over_ranks(comm_, &kind));
  for (const PastLimit& one : *found)
    if (worst(one) && one.part.kind == kind) row = std::min(row, one.part.row);
  PetscCall(min_over_ranks(comm_, &row));
  found->erase(std::remove_if(found->begin(), found->end(), [&](const PastLimit& one) { return one.part.kind != kind || one.part.row != row; }),
               found->end());
  PetscFunctionReturn(0);
}

/// Gives every rank the parts of all ranks, sorted by kind and row, each once.
PetscErrorCode Breaking::share(std::vector<PastLimit>* found) const {
  const auto place = [](const PastLimit& one) { return std::make_tuple(one.part.kind, one.part.row); };
  PetscFunctionBegin;
  PetscCall(gather_all(comm_, *found, found));
  // a spring between a particle and its own image is judged at both its links
  std::sort(found->begin(), found->end(), [&](const PastLimit& a, const PastLimit& b) { return place(a) < place(b); });
  found->erase(std::unique(found->begin(), found->end(), [&](const PastLimit& a, const PastLimit& b) { return place(a) == place(b); }), found->end());
  PetscFunctionReturn(0);
}

/// Adds what breaks together with springs that break (angle springs, hinges), and sorts the whole list again.
PetscErrorCode Breaking::add_followers(const LocalState& state, std::vector<PastLimit>* found) const {
  std::vector<std::int64_t> springs;
  std::vector<PastLimit> after;
  PetscFunctionBegin;
  for (const PastLimit& one : *found)
    if (kinds_[static_cast<std::size_t>(one.part.kind)]->leads()) springs.push_back(one.part.row);
  for (std::size_t k = 0; k < kinds_.size() && !springs.empty(); ++k) {
    const std::size_t before = after.size();
    PetscCall(kinds_[k]->follow(springs, state, &after));
    for (std::size_t one = before; one < after.size(); ++one) after[one].part.kind = static_cast<int>(k);
  }
  if (rank_ == 0) after.insert(after.end(), found->begin(), found->end());
  PetscCall(share(&after));
  *found = std::move(after);
  PetscFunctionReturn(0);
}

void Breaking::book(double t, double load, PastLimit* one) {
  kinds_[static_cast<std::size_t>(one->part.kind)]->cut(one->part.row);
  one->part.time = t + sums_.motion;
  one->part.load = load;
  one->part.number = sums_.broken++;
  one->part.avalanche = sums_.avalanches - 1;
  ++sums_.of[static_cast<std::size_t>(one->part.kind)];
  sums_.energy += one->part.energy;
  sums_.dissipated += one->dissipated;
  if (rank_ == 0) list_.push_back(one->part);
}

PetscErrorCode Breaking::break_parts(double t, double load, bool loads, const LocalState& state) {
  std::vector<PastLimit> found;
  PetscFunctionBegin;
  broke_ = 0;
  if (!active()) PetscFunctionReturn(0);
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const std::size_t before = found.size();
    kinds_[k]->judge(state, &found);
    for (std::size_t one = before; one < found.size(); ++one) found[one].part.kind = static_cast<int>(k);
  }
  bool some = false;
  PetscCall(on_some_rank(comm_, !found.empty(), &some));
  const bool goes_on = loads ? sums_.last == t : sums_.running != 0;
  sums_.running = some;
  if (!some) PetscFunctionReturn(0);
  if (worst_) PetscCall(keep_worst(&found));
  PetscCall(share(&found));
  if (with_springs_) PetscCall(add_followers(state, &found));
  if (!goes_on) ++sums_.avalanches, sums_.size = 0;
  for (PastLimit& one : found) book(t, load, &one);
  sums_.last = t;
  ++changes_;
  broke_ = static_cast<std::int64_t>(found.size());
  sums_.size += broke_;
  sums_.largest = std::max(sums_.largest, sums_.size);
  PetscFunctionReturn(0);
}

void Breaking::mark() {
  marked_list_ = list_.size();
  for (Breakable* kind : kinds_) kind->mark();
}

void Breaking::revert() {
  list_.resize(marked_list_);
  ++changes_;
  for (Breakable* kind : kinds_) kind->revert();
}

}  // namespace bs
