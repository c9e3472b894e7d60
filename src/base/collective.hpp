// The ranks of a communicator; lists and sums over all of them.
#pragma once
#include <petscsys.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace bs {

/// Local. The number of this rank in `comm`, and how many there are.
inline PetscMPIInt rank_of(MPI_Comm comm) {
  PetscMPIInt rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}
inline PetscMPIInt size_of(MPI_Comm comm) {
  PetscMPIInt ranks = 1;
  MPI_Comm_size(comm, &ranks);
  return ranks;
}

/// Collective. What `ask()` answers on rank 0, on every rank.
template <class Ask>
int ask_rank_0(MPI_Comm comm, Ask&& ask) {
  int answer = rank_of(comm) == 0 ? static_cast<int>(ask()) : 0;
  MPI_Bcast(&answer, 1, MPI_INT, 0, comm);
  return answer;
}

/// Collective. `text`, of up to 2 GB, becomes that of rank 0 on every rank.
inline PetscErrorCode share_text(MPI_Comm comm, std::string* text) {
  int length = static_cast<int>(text->size());
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&length, 1, MPI_INT, 0, comm));
  text->resize(static_cast<std::size_t>(length));
  PetscCallMPI(MPI_Bcast(text->data(), length, MPI_CHAR, 0, comm));
  PetscFunctionReturn(0);
}

/// Collective. `all` becomes the elements of rank 0, then those of rank 1 and so on, on every rank. Fails where they are more than an MPI count
/// holds.
template <typename T>
PetscErrorCode gather_all(MPI_Comm comm, const std::vector<T>& own, std::vector<T>* all) {
  static_assert(std::is_trivially_copyable_v<T>, "sent byte by byte");
  PetscMPIInt mine = 0;
  MPI_Datatype type;
  PetscFunctionBegin;
  const PetscMPIInt ranks = size_of(comm);
  PetscCall(PetscMPIIntCast(static_cast<PetscInt>(own.size()), &mine));
  std::vector<PetscMPIInt> counts(static_cast<std::size_t>(ranks)), starts(counts.size());
  PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, comm));
  std::int64_t sum = 0;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    PetscCall(PetscMPIIntCast(static_cast<PetscInt>(sum), &starts[r]));
    sum += counts[r];
  }
  std::vector<T> gathered(static_cast<std::size_t>(sum));
  PetscCallMPI(MPI_Type_contiguous(static_cast<int>(sizeof(T)), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Allgatherv(own.data(), mine, type, gathered.data(), counts.data(), starts.data(), type, comm));
  PetscCallMPI(MPI_Type_free(&type));
  *all = std::move(gathered);
  PetscFunctionReturn(0);
}

/// Collective. Replaces `count` numbers by their sums over the ranks, at most `piece` in one reduction: they may be more than an MPI count can hold.
inline PetscErrorCode sum_over_ranks(MPI_Comm comm, double* values, std::size_t count, std::size_t piece = std::size_t{1} << 27) {
  PetscFunctionBegin;
  for (std::size_t at = 0; at < count; at += piece) {
    const PetscMPIInt some = static_cast<PetscMPIInt>(std::min(piece, count - at));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, values + at, some, MPI_DOUBLE, MPI_SUM, comm));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
