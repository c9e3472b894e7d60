#include "linalg/stiff_fill.hpp"
#include <algorithm>
#include <cmath>

namespace bs {

double least_stiff_size(const PairMatrix& S) {
  constexpr double STIFF = 100;  // times the mean
  double sum = 0, count = 0, largest = 0;
  const auto note = [&](double size) {
    if (size > 0) sum += std::log(size), ++count;
    largest = std::max(largest, size);
  };
  for (std::size_t k = 0; k < S.pattern().pairs(); ++k) note(S.pair_size(k));
  for (std::size_t k = 0; k < S.pattern().ghost.size(); ++k) note(S.cut_size(k));
  const double least = count > 0 ? STIFF * std::exp(sum / count) : 0;
  return largest > least ? least : 0;
}

namespace {

struct Entry {
  PetscInt other;
  bool stiff;
};

/// The rows while fill is added to them.
class FillRows {
 public:
  FillRows(const PairMatrix& S, double least, const Overlap& overlap) : rows_(static_cast<std::size_t>(S.pattern().n) + overlap.ghosts().size()) {
    const PairPattern& pattern = S.pattern();
    for (PetscInt i = 0; i < pattern.n; ++i)
      for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k)
        rows_[i].push_back({pattern.other[k], S.pair_size(static_cast<std::size_t>(k)) > least});
    for (std::size_t r = 0; r < pattern.cut_row.size(); ++r)
      for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k) {
        const PetscInt row = overlap.row(pattern.ghost[k]);
        if (row >= 0) rows_[pattern.cut_row[r]].push_back({row, S.cut_size(static_cast<std::size_t>(k)) > least});
      }
    for (const Overlap::Tie& tie : overlap.ties()) rows_[tie.a].push_back({tie.b, true});
  }

  std::size_t size() const { return rows_.size(); }
  const std::vector<Entry>& row(std::size_t i) const { return rows_[i]; }
  /// Makes the pair (i, j > i) a stiff one, adding it where there is none.
  void add(PetscInt i, PetscInt j) {
    for (Entry& one : rows_[i])
      if (one.other == j) {
        one.stiff = true;
        return;
      }
    rows_[i].push_back({j, true});
    ++added_;
  }
  std::size_t added() const { return added_; }

 private:
  std::vector<std::vector<Entry>> rows_;
  std::size_t added_ = 0;
};

}  // namespace

bool add_stiff_fill(const PairMatrix& S, const Overlap& overlap, double least, double most, FillPattern* out) {
  if (least <= 0) return false;
  FillRows rows(S, least, overlap);
  const std::size_t limit = static_cast<std::size_t>(most * static_cast<double>(S.pattern().pairs() + S.pattern().ghost.size()));
  std::vector<Entry> row;
  for (std::size_t k = 0; k < rows.size() && rows.added() < limit; ++k) {
    row = rows.row(k);
    for (const Entry& tied : row) {
      if (!tied.stiff) continue;
      for (const Entry& one : row)
        if (one.stiff && one.other > tied.other) rows.add(tied.other, one.other);
    }
  }
  if (rows.added() >= limit) return false;
  out->start.assign(1, 0);
  out->other.clear();
  out->other.reserve(S.pattern().pairs() + S.pattern().ghost.size() + rows.added());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const Entry& one : rows.row(i)) out->other.push_back(one.other);
    out->start.push_back(static_cast<PetscInt>(out->other.size()));
  }
  return true;
}

}  // namespace bs
