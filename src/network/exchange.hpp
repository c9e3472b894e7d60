// Sends records to ranks and receives those meant for this one.
#pragma once
#include <mpi.h>
#include <petscsys.h>
#include <algorithm>
#include <numeric>
#include <type_traits>
#include <vector>

namespace bs {

/// Collective. make(k), k < count, goes to rank dest(k); `received` is ordered by sending rank, then by k, so the result is
/// reproducible. Record must be trivially copyable.
template <class Record, class Dest, class Make>
PetscErrorCode exchange(MPI_Comm comm, std::size_t count, Dest&& dest, Make&& make, std::vector<Record>* received) {
  static_assert(std::is_trivially_copyable_v<Record>);
  PetscFunctionBegin;
  int size = 1;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  const std::size_t ranks = static_cast<std::size_t>(size);
  std::vector<int> send_count(ranks, 0), receive_count(ranks, 0), send_start(ranks + 1, 0), receive_start(ranks + 1, 0);
  for (std::size_t k = 0; k < count; ++k) ++send_count[dest(k)];
  PetscCallMPI(MPI_Alltoall(send_count.data(), 1, MPI_INT, receive_count.data(), 1, MPI_INT, comm));
  std::partial_sum(send_count.begin(), send_count.end(), send_start.begin() + 1);
  std::partial_sum(receive_count.begin(), receive_count.end(), receive_start.begin() + 1);
  std::vector<Record> buffer(count);
  std::vector<int> at(send_start.begin(), send_start.end() - 1);
  for (std::size_t k = 0; k < count; ++k) buffer[at[dest(k)]++] = make(k);
  if (size == 1) {
    *received = std::move(buffer);
    PetscFunctionReturn(0);
  }
  received->resize(receive_start[ranks]);
  // counts are of whole records, so that int counts reach far
  MPI_Datatype type;
  PetscCallMPI(MPI_Type_contiguous(sizeof(Record), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Alltoallv(buffer.data(), send_count.data(), send_start.data(), type, received->data(), receive_count.data(), receive_start.data(),
                             type, comm));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(0);
}

/// Collective. items[k] goes to rank dest[k].
template <class Record>
PetscErrorCode exchange(MPI_Comm comm, const std::vector<Record>& items, const std::vector<int>& dest, std::vector<Record>* received) {
  PetscFunctionBegin;
  PetscCall(exchange(
      comm, items.size(), [&](std::size_t k) { return dest[k]; }, [&](std::size_t k) { return items[k]; }, received));
  PetscFunctionReturn(0);
}

/// Collective. exchange() in slices of at most `slice` records a rank and turn, so that what is in transit stays small beside
/// what is kept: take(received) is called once a slice, the same number of times on every rank.
template <class Record, class Dest, class Make, class Take>
PetscErrorCode exchange_in_slices(MPI_Comm comm, std::size_t count, std::size_t slice, Dest&& dest, Make&& make, Take&& take) {
  PetscFunctionBegin;
  unsigned long long turns = (count + slice - 1) / slice;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &turns, 1, MPI_UNSIGNED_LONG_LONG, MPI_MAX, comm));
  std::vector<Record> received;
  for (unsigned long long turn = 0; turn < turns; ++turn) {
    const std::size_t begin = std::min(count, static_cast<std::size_t>(turn) * slice), end = std::min(count, begin + slice);
    PetscCall(exchange(
        comm, end - begin, [&](std::size_t k) { return dest(begin + k); }, [&](std::size_t k) { return make(begin + k); }, &received));
    PetscCall(take(received));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
