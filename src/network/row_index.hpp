// Where a row of the input stands among the rows a rank has.
#pragma once
#include <petscsys.h>
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace bs {

/// Places of ascending numbers, each once: found in a step or two where they are spread evenly, by bisection at worst.
class RowIndex {
 public:
  explicit RowIndex(std::vector<std::int64_t> rows) : rows_(std::move(rows)) {
    if (rows_.empty()) return;
    const std::uint64_t range = static_cast<std::uint64_t>(rows_.back() - rows_.front());
    while (range >> shift_ > 2 * rows_.size()) ++shift_;
    start_.assign(static_cast<std::size_t>(range >> shift_) + 2, 0);
    for (const std::int64_t row : rows_) ++start_[bucket(row) + 1];
    for (std::size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
  }
  /// -1: it is not there.
  PetscInt find(std::int64_t row) const {
    if (rows_.empty() || row < rows_.front() || row > rows_.back()) return -1;
    const auto begin = rows_.begin() + start_[bucket(row)], end = rows_.begin() + start_[bucket(row) + 1];
    const auto at = std::lower_bound(begin, end, row);
    return at != end && *at == row ? static_cast<PetscInt>(at - rows_.begin()) : -1;
  }

 private:
  std::size_t bucket(std::int64_t row) const { return static_cast<std::size_t>(static_cast<std::uint64_t>(row - rows_.front()) >> shift_); }
  std::vector<std::int64_t> rows_;
  std::vector<PetscInt> start_;  ///< of 2^shift_ numbers each
  int shift_ = 0;
};

}  // namespace bs
