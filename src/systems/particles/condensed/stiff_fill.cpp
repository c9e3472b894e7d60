#include "systems/particles/condensed/stiff_fill.hpp"
#include <algorithm>
#include <cmath>

namespace bs {
namespace {

struct Entry {
  PetscInt other;
  bool stiff;
};

/// Which pairs are stiff; empty: none.
std::vector<std::uint8_t> stiff_pairs(const SpringMatrix& S) {
  constexpr double STIFF = 100;  // times the mean
  const std::size_t pairs = S.pattern().pairs();
  double sum = 0, count = 0, largest = 0;
  for (std::size_t k = 0; k < pairs; ++k) {
    const double size = S.pair_size(k);
    if (size > 0) sum += std::log(size), ++count;
    largest = std::max(largest, size);
  }
  std::vector<std::uint8_t> stiff;
  if (count == 0) return stiff;
  const double least = STIFF * std::exp(sum / count);
  if (largest <= least) return stiff;
  for (std::size_t k = 0; k < pairs; ++k) stiff.push_back(S.pair_size(k) > least);
  return stiff;
}

/// The rows while fill is added to them.
class FillRows {
 public:
  FillRows(const SpringPattern& pattern, std::vector<std::uint8_t>&& stiff)
      : pattern_(pattern), stiff_(std::move(stiff)), more_(static_cast<std::size_t>(pattern.n)) {}

  void collect(PetscInt i, std::vector<Entry>* out) const {
    out->clear();
    for (PetscInt k = pattern_.start[i]; k < pattern_.start[i + 1]; ++k) out->push_back({pattern_.other[k], stiff_[k] != 0});
    out->insert(out->end(), more_[i].begin(), more_[i].end());
  }
  /// Makes the pair (i, j > i) a stiff one, adding it where there is none.
  void add(PetscInt i, PetscInt j) {
    for (PetscInt k = pattern_.start[i]; k < pattern_.start[i + 1]; ++k)
      if (pattern_.other[k] == j) {
        stiff_[k] = 1;
        return;
      }
    for (const Entry& one : more_[i])
      if (one.other == j) return;
    more_[i].push_back({j, true});
    ++added_;
  }
  std::size_t added() const { return added_; }
  const std::vector<Entry>& more(PetscInt i) const { return more_[i]; }

 private:
  const SpringPattern& pattern_;
  std::vector<std::uint8_t> stiff_;
  std::vector<std::vector<Entry>> more_;
  std::size_t added_ = 0;
};

}  // namespace

bool add_stiff_fill(const SpringMatrix& S, double most, FillPattern* out) {
  const SpringPattern& pattern = S.pattern();
  std::vector<std::uint8_t> stiff = stiff_pairs(S);
  if (stiff.empty()) return false;
  FillRows rows(pattern, std::move(stiff));
  const std::size_t limit = static_cast<std::size_t>(most * static_cast<double>(pattern.pairs()));
  std::vector<Entry> row;
  for (PetscInt k = 0; k < pattern.n && rows.added() < limit; ++k) {
    rows.collect(k, &row);
    for (const Entry& tied : row) {
      if (!tied.stiff) continue;
      for (const Entry& one : row)
        if (one.stiff && one.other > tied.other) rows.add(tied.other, one.other);
    }
  }
  if (rows.added() >= limit) return false;
  out->start.assign(1, 0);
  out->other.clear();
  out->other.reserve(pattern.pairs() + rows.added());
  for (PetscInt i = 0; i < pattern.n; ++i) {
    out->other.insert(out->other.end(), pattern.other.begin() + pattern.start[i], pattern.other.begin() + pattern.start[i + 1]);
    for (const Entry& one : rows.more(i)) out->other.push_back(one.other);
    out->start.push_back(static_cast<PetscInt>(out->other.size()));
  }
  return true;
}

}  // namespace bs
