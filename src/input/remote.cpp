#include "input/remote.hpp"
#include <petscsf.h>
#include <algorithm>
#include "base/collective.hpp"
#include "base/handle.hpp"

namespace bs {

namespace {

/// Rank and place on it of row `row`, where chunks are those of split_rows.
PetscSFNode owner(std::int64_t row, std::int64_t total, int size) {
  const std::int64_t base = total / size, rest = total % size, longer = rest * (base + 1);
  PetscSFNode node;
  if (row < longer) {
    node.rank = static_cast<PetscInt>(row / (base + 1));
    node.index = static_cast<PetscInt>(row % (base + 1));
  } else {
    node.rank = static_cast<PetscInt>(rest + (row - longer) / base);
    node.index = static_cast<PetscInt>((row - longer) % base);
  }
  return node;
}

bool here(const Rows& rows, std::int64_t row) { return row >= rows.first && row - rows.first < rows.count; }

}  // namespace

PetscErrorCode fetch_rows(MPI_Comm comm, const Rows& rows, const std::vector<double>& values, int width, const std::vector<std::int64_t>& wanted,
                          std::vector<double>* out) {
  SFHandle sf;
  MPI_Datatype unit;
  const std::size_t w = static_cast<std::size_t>(width);
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  std::vector<std::int64_t> remote;  // each row of another rank once
  for (const std::int64_t row : wanted)
    if (!here(rows, row)) remote.push_back(row);
  std::sort(remote.begin(), remote.end());
  remote.erase(std::unique(remote.begin(), remote.end()), remote.end());
  std::vector<PetscSFNode> nodes(remote.size());
  for (std::size_t k = 0; k < remote.size(); ++k) nodes[k] = owner(remote[k], rows.total, size);
  std::vector<double> got(remote.size() * w);

  PetscCall(PetscSFCreate(comm, sf.out()));
  PetscCall(PetscSFSetGraph(sf, static_cast<PetscInt>(rows.count), static_cast<PetscInt>(remote.size()), nullptr, PETSC_COPY_VALUES, nodes.data(),
                            PETSC_COPY_VALUES));
  PetscCallMPI(MPI_Type_contiguous(width, MPI_DOUBLE, &unit));
  PetscCallMPI(MPI_Type_commit(&unit));
  PetscCall(PetscSFBcastBegin(sf, unit, values.data(), got.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, unit, values.data(), got.data(), MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));

  out->resize(wanted.size() * w);
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const double* from;
    if (here(rows, wanted[k])) {
      from = values.data() + static_cast<std::size_t>(wanted[k] - rows.first) * w;
    } else {
      const auto at = std::lower_bound(remote.begin(), remote.end(), wanted[k]) - remote.begin();
      from = got.data() + static_cast<std::size_t>(at) * w;
    }
    std::copy(from, from + w, out->data() + k * w);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode number_rows(MPI_Comm comm, Rows* rows) {
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  rows->first = 0;
  PetscCallMPI(MPI_Exscan(&rows->count, &rows->first, 1, MPI_INT64_T, MPI_SUM, comm));
  if (rank == 0) rows->first = 0;  // MPI_Exscan leaves it undefined there
  PetscCallMPI(MPI_Allreduce(&rows->count, &rows->total, 1, MPI_INT64_T, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

}  // namespace bs
