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

/// Collective. The same of numbers that are not needed any more: one rank keeps them where they are.
template <typename T>
PetscErrorCode gather_all(MPI_Comm comm, std::vector<T>&& own, std::vector<T>* all) {
  PetscFunctionBegin;
  if (size_of(comm) == 1) *all = std::move(own);
  else PetscCall(gather_all(comm, static_cast<const std::vector<T>&>(own), all));
  PetscFunctionReturn(0);
}

/// Collective. `all`, on rank 0, becomes the elements of rank 0, then those of rank 1 and so on; elsewhere nothing. Lists: vectors, texts.
template <class List>
PetscErrorCode gather_on_rank_0(MPI_Comm comm, const List& own, List* all) {
  using T = typename List::value_type;
  static_assert(std::is_trivially_copyable_v<T>, "sent byte by byte");
  const int mine = static_cast<int>(own.size());
  MPI_Datatype type;
  PetscFunctionBegin;
  std::vector<int> counts(rank_of(comm) == 0 ? static_cast<std::size_t>(size_of(comm)) : 0), starts(counts.size());
  PetscCallMPI(MPI_Gather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, comm));
  std::size_t sum = 0;
  for (std::size_t r = 0; r < counts.size(); sum += static_cast<std::size_t>(counts[r++])) starts[r] = static_cast<int>(sum);
  List gathered;
  gathered.resize(sum);
  PetscCallMPI(MPI_Type_contiguous(static_cast<int>(sizeof(T)), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Gatherv(own.data(), mine, type, gathered.data(), counts.data(), starts.data(), type, 0, comm));
  PetscCallMPI(MPI_Type_free(&type));
  *all = std::move(gathered);
  PetscFunctionReturn(0);
}

/// MPI's type of a number.
template <class T>
MPI_Datatype mpi_type() {
  static_assert(std::is_same_v<T, double> || std::is_integral_v<T>, "numbers that ranks sum or compare");
  if constexpr (std::is_same_v<T, double>) return MPI_DOUBLE;
  else if constexpr (sizeof(T) == 1) return std::is_signed_v<T> ? MPI_INT8_T : MPI_UINT8_T;
  else if constexpr (sizeof(T) == 4) return std::is_signed_v<T> ? MPI_INT32_T : MPI_UINT32_T;
  else return std::is_signed_v<T> ? MPI_INT64_T : MPI_UINT64_T;
}

/// Collective. Replaces `count` numbers by what `operation` makes of those of all ranks, at most `piece` in one reduction: they may be more than an
/// MPI count can hold.
template <class T>
PetscErrorCode reduce_over_ranks(MPI_Comm comm, MPI_Op operation, T* values, std::size_t count, std::size_t piece = std::size_t{1} << 27) {
  PetscFunctionBegin;
  for (std::size_t at = 0; at < count; at += piece) {
    const PetscMPIInt some = static_cast<PetscMPIInt>(std::min(piece, count - at));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, values + at, some, mpi_type<T>(), operation, comm));
  }
  PetscFunctionReturn(0);
}
template <class T>
PetscErrorCode sum_over_ranks(MPI_Comm comm, T* values, std::size_t count = 1) {
  return reduce_over_ranks(comm, MPI_SUM, values, count);
}
template <class T>
PetscErrorCode max_over_ranks(MPI_Comm comm, T* values, std::size_t count = 1) {
  return reduce_over_ranks(comm, MPI_MAX, values, count);
}
template <class T>
PetscErrorCode min_over_ranks(MPI_Comm comm, T* values, std::size_t count = 1) {
  return reduce_over_ranks(comm, MPI_MIN, values, count);
}

/// Collective. Whether it is so `here` on some rank.
inline PetscErrorCode on_some_rank(MPI_Comm comm, bool here, bool* somewhere) {
  int is = here;
  PetscFunctionBegin;
  PetscCall(max_over_ranks(comm, &is));
  *somewhere = is != 0;
  PetscFunctionReturn(0);
}

}  // namespace bs
