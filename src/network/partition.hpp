// Which rank each particle goes to, and where a row of the input stands among a rank's rows.
#pragma once
#include <petscmat.h>
#include <petscsys.h>
#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

/// Neighbours of this rank's chunk of particles, by row of the input.
struct RowGraph {
  std::vector<std::int64_t> start, other;
  std::vector<double> rate;  ///< of each spring [N/m]
};

/// Whether partition_rows() will look at the graph, on `size` ranks.
bool needs_graph(const Lattice& lattice, int kind, int size);

/// Collective. rank_of[k]: the new owner of row particles.first + k. `kind` as NetworkOptions::partition; `used` tells
/// which method ran. The graph is released.
PetscErrorCode partition_rows(MPI_Comm comm, const Lattice& lattice, RowGraph* graph, int kind, std::vector<int>* rank_of, std::string* used);

// Where a row of the input stands among the rows a rank has.

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
