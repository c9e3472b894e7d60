#include <algorithm>
#include <cmath>
#include "base/disjoint_sets.hpp"
#include "linalg/rigid_motions.hpp"

namespace bs {

namespace {

/// Where to divide members[begin, end), so that about `share` of them come first: at one of the larger gaps between neighbouring coordinates, so that
/// no layer of a lattice is cut; `begin` where all members have the same coordinate.
std::size_t division(std::vector<PetscInt>& members, std::size_t begin, std::size_t end, double share, const double* axis, int d) {
  constexpr double SLACK = 0.12;
  const auto before = [axis, d](PetscInt a, PetscInt b) { return axis[a * d] != axis[b * d] ? axis[a * d] < axis[b * d] : a < b; };
  const double n = static_cast<double>(end - begin);
  const std::size_t low = begin + static_cast<std::size_t>(n * std::max(0.0, share - SLACK)),
                    target = begin + static_cast<std::size_t>(std::lround(n * share));
  const std::size_t high = std::min(end, begin + static_cast<std::size_t>(n * (share + SLACK)) + 1);
  const auto at = members.begin();
  std::nth_element(at + begin, at + low, at + end, before);
  if (high < end) std::nth_element(at + low, at + high, at + end, before);
  std::sort(at + low, at + high, before);
  const auto gap = [&](std::size_t s) { return axis[members[s] * d] - axis[members[s - 1] * d]; };
  double widest = 0;
  for (std::size_t s = low + 1; s < high; ++s) widest = std::max(widest, gap(s));
  std::size_t best = begin;
  for (std::size_t s = low + 1; s < high && widest > 0; ++s) {
    if (gap(s) < 0.5 * widest) continue;
    const auto away = [target](std::size_t s_) { return s_ > target ? s_ - target : target - s_; };
    if (best == begin || away(s) < away(best)) best = s;
  }
  return best;
}

}  // namespace

void RigidGroups::create(const PairMatrix& S, PetscInt size, int steps) {
  of_.assign(static_cast<std::size_t>(S.pattern().n), -1);
  count_ = 0;
  part(S, std::max<PetscInt>(1, size));
  connect(S, std::max<PetscInt>(2, size / 8));
  blend(S, steps);
}

/// Halves the set of free points until the parts are small enough.
void RigidGroups::part(const PairMatrix& S, PetscInt size) {
  struct Range {
    std::size_t begin, end;
    PetscInt parts;
  };
  const int d = S.dim();
  const auto& points = S.graph().start;  // where they start
  std::vector<PetscInt> members;
  members.reserve(of_.size());
  for (PetscInt i = 0; i < S.pattern().n; ++i)
    if (!S.graph().fixed[i]) members.push_back(i);
  const auto wanted = [size](std::size_t n) {
    return std::max<PetscInt>(1, static_cast<PetscInt>(std::lround(static_cast<double>(n) / static_cast<double>(size))));
  };
  std::vector<Range> open{{0, members.size(), wanted(members.size())}};
  while (!open.empty()) {
    const Range range = open.back();
    open.pop_back();
    double low[3], high[3];
    int longest = 0;
    for (int c = 0; c < d; ++c) {
      low[c] = INFINITY;
      high[c] = -INFINITY;
      for (std::size_t k = range.begin; k < range.end; ++k) {
        low[c] = std::min(low[c], points[members[k] * d + c]);
        high[c] = std::max(high[c], points[members[k] * d + c]);
      }
      if (high[c] - low[c] > (1 + 1e-9) * (high[longest] - low[longest])) longest = c;
    }
    std::size_t at = range.begin;
    const auto first_parts = range.parts / 2;
    if (range.parts > 1)
      at = division(members, range.begin, range.end, static_cast<double>(first_parts) / static_cast<double>(range.parts), points.data() + longest, d);
    if (at == range.begin) {
      for (std::size_t k = range.begin; k < range.end; ++k) of_[members[k]] = static_cast<std::int32_t>(count_);
      count_ += range.end > range.begin;
      continue;
    }
    open.push_back({at, range.end, wanted(range.end - at)});
    open.push_back({range.begin, at, wanted(at - range.begin)});
  }
}

/// Splits each group into its connected components (by pairs); a component of fewer than `least` points joins the one that most of its pairs lead to.
void RigidGroups::connect(const PairMatrix& S, PetscInt least) {
  const PairPattern& pattern = S.pattern();
  const PetscInt n = pattern.n;
  DisjointSets sets(n);
  pattern.for_near([&](PetscInt i, PetscInt j) {
    if (of_[i] == of_[j]) sets.join(i, j);
  });
  // a small component joins the neighbour with which it shares most pairs, the first of equal ones
  std::vector<std::pair<PetscInt, PetscInt>> outward;  // (small component, neighbour), one entry for each pair
  pattern.for_near([&](PetscInt i, PetscInt j) {
    if (sets.top(i) == sets.top(j)) return;
    if (sets.size(i) < least) outward.emplace_back(sets.top(i), sets.top(j));
    if (sets.size(j) < least) outward.emplace_back(sets.top(j), sets.top(i));
  });
  std::sort(outward.begin(), outward.end());
  for (std::size_t k = 0; k < outward.size();) {
    const PetscInt small = outward[k].first;
    PetscInt best = outward[k].second;
    std::size_t most = 0;
    while (k < outward.size() && outward[k].first == small) {
      std::size_t end = k;
      while (end < outward.size() && outward[end] == outward[k]) ++end;
      if (end - k > most) {
        most = end - k;
        best = outward[k].second;
      }
      k = end;
    }
    sets.join(small, best);
  }
  std::vector<std::int32_t> number(static_cast<std::size_t>(n), -1);
  count_ = 0;
  for (PetscInt i = 0; i < n; ++i) {
    if (of_[i] < 0) continue;
    std::int32_t& own = number[sets.top(i)];
    const bool alone = sets.size(i) == 1 && pattern.start[i] == pattern.start[i + 1];
    if (own < 0 && !alone) own = static_cast<std::int32_t>(count_++);
    of_[i] = own;
  }
}

namespace {

/// A sparse row of (group, share) entries, to which several such rows are added up.
struct Row {
  std::int32_t group[64];
  float share[64];
  int count = 0;
  void add(const std::int32_t* groups, const float* shares, PetscInt n) {
    for (PetscInt k = 0; k < n; ++k) {
      int at = 0;
      while (at < count && group[at] != groups[k]) ++at;
      if (at == 64) continue;
      if (at == count) {
        group[count] = groups[k];
        share[count++] = 0;
      }
      share[at] += shares[k];
    }
  }
  /// Keeps the largest few shares, none below 1/50, and scales them to sum to 1.
  void trim() {
    for (int a = 1; a < count; ++a)
      for (int b = a; b > 0 && (share[b] > share[b - 1] || (share[b] == share[b - 1] && group[b] < group[b - 1])); --b) {
        std::swap(share[b], share[b - 1]);
        std::swap(group[b], group[b - 1]);
      }
    float sum = 0, all = 0;
    for (int a = 0; a < count; ++a) all += share[a];
    int kept = 0;
    while (kept < count && kept < Shares::MOST && share[kept] > 0.02F * all) sum += share[kept++];
    count = kept;
    for (int a = 0; a < count; ++a) share[a] /= sum;
  }
};

}  // namespace

/// Each step gives a point the mean of its own shares and its neighbours'. Ends of pairs that lead to other ranks keep theirs.
void RigidGroups::blend(const PairMatrix& S, int steps) {
  const PairPattern& pattern = S.pattern();
  const PetscInt n = pattern.n;
  std::vector<std::vector<PetscInt>> near(static_cast<std::size_t>(n));
  std::vector<std::uint8_t> stays(static_cast<std::size_t>(n), 0);
  for (const PetscInt i : S.boundary()) stays[i] = 1;
  pattern.for_near([&](PetscInt i, PetscInt j) {
    near[i].push_back(j);
    near[j].push_back(i);
  });
  Shares next;
  const auto begin = [](Shares* s) {
    s->start.assign(1, 0);
    s->group.clear();
    s->share.clear();
  };
  const auto append = [](Shares* s, const std::int32_t* groups, const float* shares, PetscInt count) {
    s->group.insert(s->group.end(), groups, groups + count);
    s->share.insert(s->share.end(), shares, shares + count);
    s->start.push_back(static_cast<PetscInt>(s->group.size()));
  };
  begin(&shares_);
  const float one = 1;
  for (PetscInt i = 0; i < n; ++i) append(&shares_, &of_[i], &one, of_[i] >= 0);
  for (int step = 0; step < steps; ++step) {
    begin(&next);
    const auto add = [this](Row* sum, PetscInt i) {
      const PetscInt from = shares_.start[i];
      sum->add(shares_.group.data() + from, shares_.share.data() + from, shares_.start[i + 1] - from);
    };
    for (PetscInt i = 0; i < n; ++i) {
      Row sum;
      add(&sum, i);
      if (!stays[i])
        for (const PetscInt j : near[i]) add(&sum, j);
      sum.trim();
      append(&next, sum.group, sum.share, sum.count);
    }
    std::swap(shares_, next);
  }
}

}  // namespace bs
