#include "linalg/overlap.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include "base/collective.hpp"
#include "base/disjoint_sets.hpp"
#include "base/vec_array.hpp"

namespace bs {

PetscErrorCode Overlap::create(PairMatrix& S, double least) {
  const PairPattern& pattern = S.pattern();
  bool any = false;
  PetscFunctionBegin;
  std::vector<std::uint8_t> tied(static_cast<std::size_t>(pattern.ghosts), 0);
  for (std::size_t k = 0; k < pattern.ghost.size() && least > 0; ++k)
    if (S.cut_size(k) > least) tied[static_cast<std::size_t>(pattern.ghost[k])] = 1;
  any = std::find(tied.begin(), tied.end(), 1) != tied.end();
  PetscCall(on_some_rank(S.graph().comm, any, &active_));
  if (!active_) PetscFunctionReturn(0);
  publish(S, least);
  PetscCall(find(S, &pairs_, &ties_));
  PetscCall(find(S, &remainder_, &blocks_));
  choose(S, tied);
  PetscFunctionReturn(0);
}

PetscErrorCode Overlap::create_everywhere(PairMatrix& S) {
  PetscFunctionBegin;
  PetscCall(create(S, std::numeric_limits<double>::min()));
  if (active_) PetscCall(set_weights(S));
  PetscFunctionReturn(0);
}

/// Rows for ghosts that such pairs tie to owned points, directly or by way of other ghosts; ties of these.
void Overlap::choose(const PairMatrix& S, const std::vector<std::uint8_t>& tied) {
  DisjointSets sets(static_cast<PetscInt>(tied.size()));
  for (const Tie& tie : ties_) sets.join(tie.a, tie.b);
  std::vector<std::uint8_t> reached(tied.size(), 0);
  for (std::size_t g = 0; g < tied.size(); ++g) reached[sets.top(static_cast<PetscInt>(g))] |= tied[g];
  ghosts_.clear();
  row_.assign(tied.size(), -1);
  for (PetscInt g = 0; g < static_cast<PetscInt>(tied.size()); ++g) {
    if (!reached[sets.top(g)]) continue;
    row_[static_cast<std::size_t>(g)] = S.pattern().n + static_cast<PetscInt>(ghosts_.size());
    ghosts_.push_back(g);
  }
  keep_rows(&ties_);
  keep_rows(&blocks_);
}

template <class Pair>
void Overlap::keep_rows(std::vector<Pair>* ties) const {
  ties->erase(std::remove_if(ties->begin(), ties->end(), [&](const Pair& tie) { return row(tie.a) < 0 || row(tie.b) < 0; }), ties->end());
  for (Pair& tie : *ties) tie = {row(tie.a), row(tie.b), {}, tie.slot};
  std::stable_sort(ties->begin(), ties->end(), [](const Pair& one, const Pair& other) { return one.a < other.a; });
}

/// Makes the lists of this rank's pairs above `least`, from both ends, and of its rows of the remainder.
void Overlap::publish(const PairMatrix& S, double least) {
  const PairPattern& pattern = S.pattern();
  const Graph& graph = S.graph();
  struct Half {
    PetscInt i, other;
    const float* numbers;
  };
  std::vector<Half> halves;
  for (PetscInt i = 0; i < pattern.n && least > 0; ++i)
    for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) {
      const std::size_t at = static_cast<std::size_t>(k);
      if (S.pair_size(at) <= least) continue;
      halves.push_back({i, graph.global[pattern.other[k]], S.pair(at)});
      halves.push_back({pattern.other[k], graph.global[i], S.pair(at)});
    }
  for (std::size_t r = 0; r < pattern.cut_row.size() && least > 0; ++r)
    for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k) {
      const std::size_t at = static_cast<std::size_t>(k);
      if (S.cut_size(at) > least) halves.push_back({pattern.cut_row[r], graph.global[pattern.n + pattern.ghost[k]], S.cut(at)});
    }
  std::stable_sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) { return a.i < b.i; });
  pairs_ = {};
  remainder_ = {};
  std::size_t next = 0;
  for (PetscInt i = 0; i < pattern.n; ++i) {
    pairs_.start.push_back(static_cast<PetscInt>(pairs_.other.size()));
    for (; next < halves.size() && halves[next].i == i; ++next) {
      pairs_.other.push_back(halves[next].other);
      pairs_.numbers.push_back(halves[next].numbers);
    }
    remainder_.start.push_back(static_cast<PetscInt>(remainder_.other.size()));
    if (S.remainder().created())
      S.remainder().for_row(i, [&](PetscInt j, const double* block) {
        remainder_.other.push_back(graph.global[j]);
        remainder_.numbers.push_back(block);
      });
  }
  pairs_.start.push_back(static_cast<PetscInt>(pairs_.other.size()));
  remainder_.start.push_back(static_cast<PetscInt>(remainder_.other.size()));
}

/// Collective. all: value(i, c) of owned points i, then what their owners give for the ghosts; (owned and ghosts, d).
template <class Value>
PetscErrorCode Overlap::send(PairMatrix& S, Value&& value, std::vector<double>* all) const {
  const PetscInt n = S.pattern().n, d = S.dim();
  PetscFunctionBegin;
  all->assign(static_cast<std::size_t>(n * d), 0.0);
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt c = 0; c < d; ++c) (*all)[static_cast<std::size_t>(i * d + c)] = value(i, c);
  PetscCall(S.append_ghosts(all));
  PetscFunctionReturn(0);
}

// Of all ghosts, by their numbers as ghosts. Images of points in a periodic box share their point's number: ties between them are left out,
// and those of a point beyond the first MOST, since each is sent for all points.
template <class Number, class Pair>
PetscErrorCode Overlap::find(PairMatrix& S, Told<Number>* told, std::vector<Pair>* ties) const {
  constexpr PetscInt MOST = 32;
  const Graph& graph = S.graph();
  const PetscInt n = graph.n, d = S.dim();
  const std::vector<PetscInt>& start = told->start;
  std::unordered_map<PetscInt, PetscInt> ghost;  // of a global number
  std::vector<double> all;
  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; ++i) told->slots = std::max(told->slots, std::min(MOST, start[i + 1] - start[i]));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &told->slots, 1, MPIU_INT, MPI_MAX, graph.comm));
  for (PetscInt g = 0; g < graph.ghosts && !graph.periodic; ++g) ghost[graph.global[n + g]] = g;
  ties->clear();
  for (PetscInt slot = 0; slot < told->slots; ++slot) {
    const auto number = [&](PetscInt i, PetscInt c) {
      return c == 0 && start[i] + slot < start[i + 1] ? 1.0 + static_cast<double>(told->other[start[i] + slot]) : 0.0;
    };
    PetscCall(send(S, number, &all));
    for (PetscInt g = 0; g < graph.ghosts; ++g) {
      const auto end = ghost.find(static_cast<PetscInt>(all[static_cast<std::size_t>((n + g) * d)]) - 1);
      if (end != ghost.end() && g < end->second) ties->push_back({g, end->second, {}, slot});
    }
  }
  PetscFunctionReturn(0);
}

/// Collective. `width` numbers of every tie, d at a time.
template <class Number, class Pair>
PetscErrorCode Overlap::renew(PairMatrix& S, const Told<Number>& told, PetscInt width, std::vector<Pair>* ties) const {
  const PetscInt n = S.pattern().n, d = S.dim();
  std::vector<double> all;
  PetscFunctionBegin;
  for (PetscInt slot = 0; slot < told.slots; ++slot)
    for (PetscInt first = 0; first < width; first += d) {
      const auto number = [&](PetscInt i, PetscInt c) {
        return told.start[i] + slot < told.start[i + 1] && first + c < width ? static_cast<double>(told.numbers[told.start[i] + slot][first + c])
                                                                             : 0.0;
      };
      PetscCall(send(S, number, &all));
      for (Pair& tie : *ties)
        for (PetscInt c = 0; c < d && tie.slot == slot && first + c < width; ++c)
          tie.numbers[first + c] = static_cast<Number>(all[static_cast<std::size_t>((n + ghosts_[tie.a - n]) * d + c)]);
    }
  PetscFunctionReturn(0);
}

PetscErrorCode Overlap::update(PairMatrix& S, std::vector<double>* diagonal) {
  const PetscInt n = S.pattern().n, d = S.dim(), area = d * d;
  std::vector<double> all;
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  PetscCall(renew(S, pairs_, d + 1, &ties_));
  PetscCall(renew(S, remainder_, area, &blocks_));
  diagonal->resize((static_cast<std::size_t>(n) + ghosts_.size()) * static_cast<std::size_t>(area));
  for (PetscInt r = 0; r < d; ++r) {  // row by row of the blocks
    PetscCall(send(
        S, [&](PetscInt i, PetscInt c) { return (*diagonal)[static_cast<std::size_t>(i * area + r * d + c)]; }, &all));
    for (const PetscInt g : ghosts_) std::copy_n(all.data() + (n + g) * d, d, diagonal->data() + row(g) * area + r * d);
  }
  PetscFunctionReturn(0);
}

/// 1/sqrt(m) for a point that is a row of m ranks.
PetscErrorCode Overlap::set_weights(PairMatrix& S) {
  const PetscInt n = S.pattern().n, d = S.dim();
  std::vector<double> rows(static_cast<std::size_t>(S.pattern().ghosts * d), 0.0), all;
  VecHandle count;
  PetscFunctionBegin;
  PetscCall(S.create_vector(count.out()));
  PetscCall(VecSet(count, 1));
  for (const PetscInt g : ghosts_) rows[static_cast<std::size_t>(g * d)] = 1;
  PetscCall(S.add_ghosts(rows, count));
  {
    const ReadArray m(count);
    PetscCall(send(
        S, [&](PetscInt i, PetscInt) { return 1 / std::sqrt(m[i * d]); }, &all));
  }
  weight_.clear();
  for (PetscInt i = 0; i < n; ++i) weight_.push_back(all[static_cast<std::size_t>(i * d)]);
  for (const PetscInt g : ghosts_) weight_.push_back(all[static_cast<std::size_t>((n + g) * d)]);
  PetscFunctionReturn(0);
}

void Overlap::weigh(PetscInt d, std::vector<double>* rows) const {
  for (std::size_t k = 0; k < weight_.size(); ++k)
    for (PetscInt c = 0; c < d; ++c) (*rows)[k * static_cast<std::size_t>(d) + static_cast<std::size_t>(c)] *= weight_[k];
}

PetscErrorCode Overlap::fetch(PairMatrix& S, Vec in) {
  const std::size_t d = static_cast<std::size_t>(S.dim()), own = static_cast<std::size_t>(S.pattern().n) * d;
  PetscFunctionBegin;
  PetscCall(S.fetch_ghosts(in, &values_));
  in_.resize(own + ghosts_.size() * d);
  out_.resize(in_.size());
  std::copy_n(ReadArray(in).data(), own, in_.data());
  for (std::size_t k = 0; k < ghosts_.size(); ++k)
    std::copy_n(values_.data() + static_cast<std::size_t>(ghosts_[k]) * d, d, in_.data() + own + k * d);
  PetscFunctionReturn(0);
}

PetscErrorCode Overlap::add(PairMatrix& S, Vec out) {
  const std::size_t d = static_cast<std::size_t>(S.dim()), own = static_cast<std::size_t>(S.pattern().n) * d;
  PetscFunctionBegin;
  std::copy_n(out_.data(), own, WriteArray(out).data());
  std::fill(values_.begin(), values_.end(), 0.0);
  for (std::size_t k = 0; k < ghosts_.size(); ++k)
    std::copy_n(out_.data() + own + k * d, d, values_.data() + static_cast<std::size_t>(ghosts_[k]) * d);
  PetscCall(S.add_ghosts(values_, out));
  PetscFunctionReturn(0);
}

}  // namespace bs
