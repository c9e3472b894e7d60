// What is shown and kept of broken springs: observables, flags, the list, checkpoints.
#include <algorithm>
#include <cmath>
#include "base/vec_array.hpp"
#include "systems/particles/breaking/breaking.hpp"

namespace bs {

PetscErrorCode Breaking::observe(std::vector<Observable>* out) const {
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  out->push_back({"broken_springs", {static_cast<double>(sums_.broken)}});
  out->push_back({"broken_energy", {sums_.energy}});
  PetscFunctionReturn(0);
}

std::vector<Tally> Breaking::tallies() const {
  if (!active_) return {};
  return {{"broken_springs", "spring{s} broke, as judged where each step ends", sums_.broken},
          {"avalanches", "avalanche{s}", sums_.avalanches},
          {"largest_avalanche", "spring{s} broke in the largest avalanche", sums_.largest}};
}

PetscErrorCode Breaking::flags(Vec* out) {
  PetscFunctionBegin;
  PetscCall(table_.gather([&](PetscInt, PetscInt e) { return net_->links.is_broken(e) ? 1.0 : 0.0; }, &flags_));
  *out = flags_;
  PetscFunctionReturn(0);
}

namespace {

constexpr double NO_STRAIN = -2;  // in a checkpoint, of a spring of rest length 0: below every strain

/// What a checkpoint holds of every spring, 0 where it is whole; a spring that the lattice gave as broken has the number 0.
struct Entry {
  const char* name;
  double (*of)(const BrokenSpring& one);
  void (*put)(double value, BrokenSpring* one);
};
const Entry ENTRIES[] = {
    {"break_number", [](const BrokenSpring& b) { return static_cast<double>(b.number + 1); },
     [](double v, BrokenSpring* b) { b->number = static_cast<std::int64_t>(v) - 1; }},
    {"break_first_end", [](const BrokenSpring& b) { return static_cast<double>(b.ends[0]); },
     [](double v, BrokenSpring* b) { b->ends[0] = static_cast<std::int64_t>(v); }},
    {"break_second_end", [](const BrokenSpring& b) { return static_cast<double>(b.ends[1]); },
     [](double v, BrokenSpring* b) { b->ends[1] = static_cast<std::int64_t>(v); }},
    {"break_avalanche", [](const BrokenSpring& b) { return static_cast<double>(b.avalanche); },
     [](double v, BrokenSpring* b) { b->avalanche = static_cast<std::int64_t>(v); }},
    {"break_time", [](const BrokenSpring& b) { return b.time; }, [](double v, BrokenSpring* b) { b->time = v; }},
    {"break_load", [](const BrokenSpring& b) { return b.load; }, [](double v, BrokenSpring* b) { b->load = v; }},
    {"break_strain", [](const BrokenSpring& b) { return std::isnan(b.strain) ? NO_STRAIN : b.strain; },
     [](double v, BrokenSpring* b) { b->strain = v == NO_STRAIN ? NAN : v; }},
    {"break_energy", [](const BrokenSpring& b) { return b.energy; }, [](double v, BrokenSpring* b) { b->energy = v; }},
};

}  // namespace

PetscErrorCode Breaking::gather(std::vector<StatePart>* parts) {
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  Vec like = nullptr;
  PetscCall(flags(&like));
  if (kept_.empty())
    for (const Entry& entry : ENTRIES) {
      kept_.push_back({entry.name, {}});
      PetscCall(VecDuplicate(like, kept_.back().rows.out()));
    }
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    PetscCall(VecZeroEntries(kept_[k].rows));
    for (const BrokenSpring& one : list_) PetscCall(VecSetValue(kept_[k].rows, static_cast<PetscInt>(one.row), ENTRIES[k].of(one), INSERT_VALUES));
    PetscCall(VecAssemblyBegin(kept_[k].rows));
    PetscCall(VecAssemblyEnd(kept_[k].rows));
    parts->push_back({kept_[k].name, kept_[k].rows});
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Breaking::scatter() {
  VecHandle first;
  ScatterHandle to_first;
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  list_.clear();
  PetscCall(table_.spread(kept_[0].rows, [&](PetscInt e, double number) {
    if (number > 0) cut(e);
  }));
  PetscCall(VecScatterCreateToZero(kept_[0].rows, to_first.out(), first.out()));
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    PetscInt count;
    PetscCall(VecScatterBegin(to_first, kept_[k].rows, first, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(to_first, kept_[k].rows, first, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGetLocalSize(first, &count));
    const ReadArray a(first);
    if (k == 0)
      for (PetscInt row = 0; row < count; ++row)
        if (a[row] > 0) {
          list_.emplace_back();
          list_.back().row = row;
        }
    for (BrokenSpring& one : list_) ENTRIES[k].put(a[one.row], &one);
  }
  std::sort(list_.begin(), list_.end(), [](const BrokenSpring& a, const BrokenSpring& b) { return a.number < b.number; });
  PetscFunctionReturn(0);
}

void Breaking::save(std::map<std::string, double>* sums) const {
  if (!active_) return;
  (*sums)["breaking/broken"] = static_cast<double>(sums_.broken);
  (*sums)["breaking/avalanches"] = static_cast<double>(sums_.avalanches);
  (*sums)["breaking/size"] = static_cast<double>(sums_.size);
  (*sums)["breaking/largest"] = static_cast<double>(sums_.largest);
  (*sums)["breaking/running"] = static_cast<double>(sums_.running);
  (*sums)["breaking/energy"] = sums_.energy;
  (*sums)["breaking/dissipated"] = sums_.dissipated;
  (*sums)["breaking/motion_steps"] = static_cast<double>(sums_.motion_steps);
  (*sums)["breaking/motion"] = sums_.motion;
  (*sums)["breaking/last"] = sums_.last;
}

void Breaking::restore(const std::map<std::string, double>& sums) {
  if (!active_) return;
  const auto number = [&](const char* name, double otherwise) {
    const auto at = sums.find(name);
    return at == sums.end() ? otherwise : at->second;
  };
  const auto whole = [&](const char* name) { return static_cast<std::int64_t>(number(name, 0)); };
  sums_.broken = whole("breaking/broken");
  sums_.avalanches = whole("breaking/avalanches");
  sums_.size = whole("breaking/size");
  sums_.largest = whole("breaking/largest");
  sums_.running = whole("breaking/running");
  sums_.energy = number("breaking/energy", 0);
  sums_.dissipated = number("breaking/dissipated", 0);
  sums_.motion_steps = whole("breaking/motion_steps");
  sums_.motion = number("breaking/motion", 0);
  sums_.last = number("breaking/last", -1);
}

PetscErrorCode Breaking::tables(std::vector<Dataset>* out) const {
  PetscFunctionBegin;
  if (!active_ || sums_.broken == 0) PetscFunctionReturn(0);
  const std::int64_t total = sums_.broken;
  const std::string events = "/events/broken/";
  std::vector<double> time, load, strain, energy;
  std::vector<std::int64_t> spring, ends, avalanche;
  for (const BrokenSpring& one : list_) {
    time.push_back(one.time);
    load.push_back(one.load);
    strain.push_back(one.strain);
    energy.push_back(one.energy);
    spring.push_back(one.row);
    ends.insert(ends.end(), {one.ends[0], one.ends[1]});
    avalanche.push_back(one.avalanche);
  }
  // other ranks hold none of it, behind its end
  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(net_->comm, &rank));
  const std::int64_t first = rank == 0 ? 0 : total;
  out->push_back({events + "time", first, total, 0, std::move(time), {}, {0, 0, 1}});
  out->push_back({events + "load", first, total, 0, std::move(load)});
  out->push_back({events + "spring", first, total, 0, std::move(spring)});
  out->push_back({events + "ends", first, total, 2, std::move(ends)});
  out->push_back({events + "strain", first, total, 0, std::move(strain), {}, {}, true});
  out->push_back({events + "energy", first, total, 0, std::move(energy), {}, {1, 2, -2}});
  out->push_back({events + "avalanche", first, total, 0, std::move(avalanche)});
  PetscFunctionReturn(0);
}

void Breaking::put_thresholds(const Lattice& lattice, std::vector<Dataset>* out) const {
  const Rows& s = lattice.springs;
  for (int c = 0; c < BREAK_LIMITS && active_ && rules_.scatter != BreakRules::none; ++c) {
    const Column* own = find_column(lattice.break_columns, break_limits[c].name);
    if (!own && !std::isfinite(rules_.limit[c])) continue;
    std::vector<double> value = own ? own->value : std::vector<double>(static_cast<std::size_t>(s.count), rules_.limit[c]);
    for (std::size_t k = 0; k < value.size(); ++k) value[k] *= rules_.factor(s.first + static_cast<std::int64_t>(k));
    out->push_back(
        {std::string("/connectivity/bonds_") + break_limits[c].threshold, s.first, s.total, 0, std::move(value), {}, break_limits[c].powers, true});
  }
}

}  // namespace bs
