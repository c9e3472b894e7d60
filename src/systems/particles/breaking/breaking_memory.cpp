// What is shown and kept of what broke: observables, the lists, checkpoints.
#include <algorithm>
#include <cmath>
#include <functional>
#include "base/collective.hpp"
#include "base/vec_array.hpp"
#include "systems/particles/breaking/breaking.hpp"

namespace bs {

PetscErrorCode Breaking::fields(std::vector<Field>* out) {
  PetscFunctionBegin;
  for (Breakable* kind : kinds_) {
    Vec broken;
    PetscCall(kind->flags(&broken));
    out->push_back({"/backspring/" + kind->words().events, broken, true});
  }
  PetscFunctionReturn(0);
}

void Breaking::observe(std::vector<Observable>* out) const {
  for (std::size_t k = 0; k < kinds_.size(); ++k) out->push_back({kinds_[k]->words().count, {static_cast<double>(sums_.of[k])}});
  if (active()) out->push_back({"broken_energy", {sums_.energy}});
}

std::vector<Tally> Breaking::tallies() const {
  std::vector<Tally> all;
  if (!active()) return all;
  for (std::size_t k = 0; k < kinds_.size(); ++k)
    all.push_back({kinds_[k]->words().count, kinds_[k]->words().title + "{s} broke, as judged where each step ends", sums_.of[k]});
  const std::string part = kinds_.size() == 1 ? kinds_[0]->words().title : "part";
  all.push_back({"avalanches", "avalanche{s}", sums_.avalanches});
  all.push_back({"largest_avalanche", part + "{s} broke in the largest avalanche", sums_.largest});
  return all;
}

namespace {

constexpr double NO_STRAIN = -2;  // in a checkpoint, of a spring of rest length 0: below every strain

const char* const END_NAMES[MOST_ENDS] = {"first_end", "second_end", "third_end", "fourth_end"};

/// What a checkpoint holds of every part, 0 where it is whole; one that the lattice gave as broken has the number 0.
struct Entry {
  std::string name;
  std::function<double(const Broken&)> of;
  std::function<void(double, Broken*)> put;
};

std::vector<Entry> entries_of(const BreakWords& words) {
  std::vector<Entry> all{{"number", [](const Broken& b) { return static_cast<double>(b.number + 1); },
                          [](double v, Broken* b) { b->number = static_cast<std::int64_t>(v) - 1; }}};
  for (int a = 0; a < words.ends; ++a)
    all.push_back({END_NAMES[a], [a](const Broken& b) { return static_cast<double>(b.ends[a]); },
                   [a](double v, Broken* b) { b->ends[a] = static_cast<std::int64_t>(v); }});
  all.push_back({"avalanche", [](const Broken& b) { return static_cast<double>(b.avalanche); },
                 [](double v, Broken* b) { b->avalanche = static_cast<std::int64_t>(v); }});
  all.push_back({"time", [](const Broken& b) { return b.time; }, [](double v, Broken* b) { b->time = v; }});
  all.push_back({"load", [](const Broken& b) { return b.load; }, [](double v, Broken* b) { b->load = v; }});
  all.push_back({words.strain, [](const Broken& b) { return std::isnan(b.strain) ? NO_STRAIN : b.strain; },
                 [](double v, Broken* b) { b->strain = v == NO_STRAIN ? NAN : v; }});
  all.push_back({"energy", [](const Broken& b) { return b.energy; }, [](double v, Broken* b) { b->energy = v; }});
  for (Entry& one : all) one.name = words.kept + one.name;
  return all;
}

}  // namespace

PetscErrorCode Breaking::gather_kind(std::size_t kind, std::vector<StatePart>* parts) {
  const std::vector<Entry> entries = entries_of(kinds_[kind]->words());
  std::vector<VecHandle>& kept = kept_[kind];
  Vec like = nullptr;
  PetscFunctionBegin;
  PetscCall(kinds_[kind]->flags(&like));
  kept.resize(entries.size());
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!kept[k]) PetscCall(VecDuplicate(like, kept[k].out()));
    PetscCall(VecZeroEntries(kept[k]));
    for (const Broken& one : list_)
      if (one.kind == static_cast<int>(kind)) PetscCall(VecSetValue(kept[k], static_cast<PetscInt>(one.row), entries[k].of(one), INSERT_VALUES));
    PetscCall(VecAssemblyBegin(kept[k]));
    PetscCall(VecAssemblyEnd(kept[k]));
    parts->push_back({entries[k].name, kept[k]});
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Breaking::gather(std::vector<StatePart>* parts) {
  PetscFunctionBegin;
  kept_.resize(kinds_.size());
  for (std::size_t kind = 0; kind < kinds_.size(); ++kind) PetscCall(gather_kind(kind, parts));
  PetscFunctionReturn(0);
}

/// Rank 0 gets the list of that kind, all ranks the rows in it.
PetscErrorCode Breaking::recall_kind(std::size_t kind) {
  const std::vector<Entry> entries = entries_of(kinds_[kind]->words());
  const std::size_t before = list_.size();
  std::vector<std::int64_t> rows;
  VecHandle first;
  ScatterHandle to_first;
  PetscFunctionBegin;
  PetscCall(VecScatterCreateToZero(kept_[kind][0], to_first.out(), first.out()));
  for (std::size_t k = 0; k < entries.size(); ++k) {
    PetscInt count;
    PetscCall(scatter_all(to_first, kept_[kind][k], first));
    PetscCall(VecGetLocalSize(first, &count));
    const ReadArray a(first);
    for (PetscInt row = 0; row < count && k == 0; ++row)
      if (a[row] > 0) {
        Broken one;
        one.row = row;
        one.kind = static_cast<int>(kind);
        list_.push_back(one);
        rows.push_back(row);
      }
    for (std::size_t one = before; one < list_.size(); ++one) entries[k].put(a[list_[one].row], &list_[one]);
  }
  PetscCall(gather_all(comm_, rows, &rows));
  for (const std::int64_t row : rows) kinds_[kind]->cut(row);
  PetscFunctionReturn(0);
}

PetscErrorCode Breaking::recall() {
  PetscFunctionBegin;
  list_.clear();
  for (Breakable* kind : kinds_) kind->mend();
  for (std::size_t kind = 0; kind < kinds_.size(); ++kind) PetscCall(recall_kind(kind));
  std::sort(list_.begin(), list_.end(), [](const Broken& a, const Broken& b) { return a.number < b.number; });
  PetscFunctionReturn(0);
}

void Breaking::keep(const Keeper& keep) {
  if (!active()) return;
  keep("breaking/broken", sums_.broken);
  keep("breaking/avalanches", sums_.avalanches);
  keep("breaking/size", sums_.size);
  keep("breaking/largest", sums_.largest);
  keep("breaking/running", sums_.running);
  keep("breaking/energy", sums_.energy);
  keep("breaking/dissipated", sums_.dissipated);
  keep("breaking/motion_steps", sums_.motion_steps);
  keep("breaking/motion", sums_.motion);
  keep("breaking/last", sums_.last, -1);
  sums_.of[0] = sums_.broken;  // all that are none of the other kinds
  for (std::size_t k = 1; k < kinds_.size(); ++k) {
    keep("breaking/" + kinds_[k]->words().count, sums_.of[k]);
    sums_.of[0] -= sums_.of[k];
  }
}

PetscErrorCode Breaking::tables(std::vector<Dataset>* out) const {
  PetscFunctionBegin;
  for (std::size_t kind = 0; kind < kinds_.size(); ++kind) {
    const std::int64_t total = sums_.of[kind];
    if (total == 0) continue;
    const BreakWords& words = kinds_[kind]->words();
    const std::string events = "/events/" + words.events + "/";
    std::vector<double> time, load, strain, energy;
    std::vector<std::int64_t> row, ends, avalanche, number;
    for (const Broken& one : list_) {
      if (one.kind != static_cast<int>(kind)) continue;
      time.push_back(one.time);
      load.push_back(one.load);
      strain.push_back(one.strain);
      energy.push_back(one.energy);
      row.push_back(one.row);
      ends.insert(ends.end(), one.ends, one.ends + words.ends);
      avalanche.push_back(one.avalanche);
      number.push_back(one.number);
    }
    const std::int64_t first = rank_ == 0 ? 0 : total;  // other ranks hold none of it, behind its end
    out->push_back({events + "time", first, total, 0, std::move(time), {}, {0, 0, 1}});
    out->push_back({events + "load", first, total, 0, std::move(load)});
    out->push_back({events + words.row, first, total, 0, std::move(row)});
    out->push_back({events + "ends", first, total, words.ends, std::move(ends)});
    out->push_back({events + words.strain, first, total, 0, std::move(strain), {}, words.powers, true});
    out->push_back({events + "energy", first, total, 0, std::move(energy), {}, {1, 2, -2}});
    out->push_back({events + "avalanche", first, total, 0, std::move(avalanche)});
    if (kinds_.size() > 1) out->push_back({events + "number", first, total, 0, std::move(number)});
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
