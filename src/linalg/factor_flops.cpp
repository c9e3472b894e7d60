#include "linalg/factor_flops.hpp"
#include <petscmat.h>
#include <algorithm>
#include <numeric>
#include <vector>
#include "base/collective.hpp"
#include "base/handle.hpp"

namespace bs {
namespace {

/// The graph of linked free points, numbered by row of the input, in compressed rows; complete on rank 0.
struct CompressedRows {
  std::vector<PetscInt> start, other;
};

PetscErrorCode gather_graph(MPI_Comm comm, const std::vector<std::int64_t>& own_row, const std::vector<PetscInt>& own_ends, CompressedRows* out) {
  std::vector<std::int64_t> row;
  std::vector<PetscInt> ends;
  PetscFunctionBegin;
  PetscCall(gather_on_rank_0(comm, own_row, &row));  // in the order of global numbers
  PetscCall(gather_on_rank_0(comm, own_ends, &ends));
  std::vector<std::pair<PetscInt, PetscInt>> pairs;
  for (std::size_t k = 0; k < ends.size(); k += 2)
    pairs.emplace_back(row[static_cast<std::size_t>(ends[k])], row[static_cast<std::size_t>(ends[k + 1])]);
  for (std::size_t i = 0; i < row.size(); ++i) pairs.emplace_back(i, i);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  out->start.assign(row.size() + 1, 0);
  for (const auto& [i, j] : pairs) {
    ++out->start[static_cast<std::size_t>(i) + 1];
    out->other.push_back(j);
  }
  std::partial_sum(out->start.begin(), out->start.end(), out->start.begin());
  PetscFunctionReturn(0);
}

/// place[i]: when point i is eliminated.
PetscErrorCode dissect(CompressedRows& graph, std::vector<PetscInt>* place) {
  const PetscInt n = static_cast<PetscInt>(graph.start.size()) - 1;
  std::vector<PetscScalar> values(graph.other.size(), 1);
  MatHandle A;
  ISHandle rows, columns;
  const PetscInt* order = nullptr;
  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, n, n, graph.start.data(), graph.other.data(), values.data(), A.out()));
  PetscCall(MatGetOrdering(A, MATORDERINGND, rows.out(), columns.out()));
  place->resize(static_cast<std::size_t>(n));
  PetscCall(ISGetIndices(rows, &order));
  for (PetscInt k = 0; k < n; ++k) (*place)[order[k]] = k;
  PetscCall(ISRestoreIndices(rows, &order));
  PetscFunctionReturn(0);
}

/// entries[k]: of the factor in the column that is eliminated k-th, with the diagonal, in blocks. Column k holds what its row of the matrix
/// holds to its right, and what the columns hold whose first entry is in row k.
std::vector<PetscInt> count_columns(const CompressedRows& graph, const std::vector<PetscInt>& place) {
  const std::size_t n = place.size();
  std::vector<PetscInt> entries(n), seen(n, -1);
  std::vector<std::vector<PetscInt>> column(n), children(n);
  std::vector<std::size_t> particle(n);
  for (std::size_t i = 0; i < n; ++i) particle[place[i]] = i;
  for (std::size_t k = 0; k < n; ++k) {
    std::vector<PetscInt>& mine = column[k];
    const PetscInt now = static_cast<PetscInt>(k);
    const auto add = [&](PetscInt row) {
      if (row <= now || seen[row] == now) return;
      seen[row] = now;
      mine.push_back(row);
    };
    for (PetscInt e = graph.start[particle[k]]; e < graph.start[particle[k] + 1]; ++e) add(place[graph.other[e]]);
    for (const PetscInt child : children[k]) {
      for (const PetscInt row : column[child]) add(row);
      std::vector<PetscInt>().swap(column[child]);
    }
    entries[k] = 1 + static_cast<PetscInt>(mine.size());
    if (!mine.empty()) children[*std::min_element(mine.begin(), mine.end())].push_back(now);
  }
  return entries;
}

}  // namespace

PetscErrorCode predict_factor_flops(MPI_Comm comm, int dim, const std::vector<std::int64_t>& row, const std::vector<PetscInt>& ends, double* flops) {
  CompressedRows graph;
  std::vector<PetscInt> place;
  PetscFunctionBegin;
  *flops = 0;
  const PetscMPIInt rank = rank_of(comm);
  PetscCall(gather_graph(comm, row, ends, &graph));
  if (rank == 0 && !graph.other.empty()) {
    PetscCall(dissect(graph, &place));
    for (const PetscInt entries : count_columns(graph, place)) {
      const double rows = dim * static_cast<double>(entries);
      *flops += dim * rows * rows;
    }
  }
  PetscCallMPI(MPI_Bcast(flops, 1, MPI_DOUBLE, 0, comm));
  PetscFunctionReturn(0);
}

}  // namespace bs
