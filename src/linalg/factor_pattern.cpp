#include "linalg/factor_pattern.hpp"
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
    for (PetscInt i = 0; i < pattern.n && S.remainder().created(); ++i)
      S.remainder().for_row(i, [&](PetscInt j, const double*) {
        const PetscInt row = j < pattern.n ? j : overlap.row(j - pattern.n);
        if (row > i) (void)entry(i, row);
      });
    blocks_ = pattern.pairs() + pattern.ghost.size() + added_;
    added_ = 0;
  }

  /// Adds fill; false where it would be `most` times the blocks that were there, or more.
  bool fill(double most) {
    const std::size_t limit = static_cast<std::size_t>(most * static_cast<double>(blocks_));
    std::vector<Entry> row;
    for (std::size_t k = 0; k < rows_.size() && added_ < limit; ++k) {
      row = rows_[k];
      for (const Entry& tied : row) {
        if (!tied.stiff) continue;
        for (const Entry& one : row)
          if (one.stiff && one.other > tied.other) entry(tied.other, one.other).stiff = true;
      }
    }
    return added_ < limit;
  }
  void write(FactorPattern* out) const {
    out->start.assign(1, 0);
    out->other.clear();
    out->other.reserve(blocks_ + added_);
    for (const std::vector<Entry>& row : rows_) {
      for (const Entry& one : row) out->other.push_back(one.other);
      out->start.push_back(static_cast<PetscInt>(out->other.size()));
    }
  }

 private:
  /// The entry (i, j > i), added where there is none.
  Entry& entry(PetscInt i, PetscInt j) {
    for (Entry& one : rows_[i])
      if (one.other == j) return one;
    ++added_;
    rows_[i].push_back({j, false});
    return rows_[i].back();
  }

  std::vector<std::vector<Entry>> rows_;
  std::size_t blocks_ = 0, added_ = 0;  ///< of S, and what entry() has added
};

}  // namespace

bool make_factor_pattern(const PairMatrix& S, double least, double most, Overlap* overlap, FactorPattern* out) {
  if (least > 0) {
    FillRows rows(S, least, *overlap);
    if (rows.fill(most)) {
      rows.write(out);
      return true;
    }
  }
  overlap->leave_out();
  if (!S.remainder().created()) return false;
  FillRows(S, 0, *overlap).write(out);
  return true;
}

}  // namespace bs
