// Rows of the input on their way to the ranks that will own them: the records, their exchange, and the memory that takes; interactions, and what
// springs and particles carry by columns.
#pragma once
#include <mpi.h>
#include <petscsys.h>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <type_traits>
#include <vector>
#include "base/collective.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"
#include "network/network.hpp"
#include "network/partition.hpp"

namespace bs {

// The number by which half springs name their other end: its row in the input and, in a periodic box, which of its images it is.

/// row * 2^21 + three shifts of 7 bits; ascending by row, then the particle itself, then its images. Without a periodic box all are
/// rows * 2^21.
namespace image {

constexpr int BITS = 7, SHIFT_BITS = 3 * BITS, MOST = 63;

/// 0, 1, -1, 2, -2, ... become 0, 1, 2, 3, 4, ...
inline std::int64_t fold(std::int64_t s) { return s > 0 ? 2 * s - 1 : -2 * s; }
inline int unfold(std::int64_t f) { return static_cast<int>(f % 2 ? (f + 1) / 2 : -f / 2); }

inline std::int64_t key(std::int64_t row) { return row << SHIFT_BITS; }
/// |shift| <= MOST
inline std::int64_t key(std::int64_t row, const std::int64_t* shift, int d, int sign) {
  std::int64_t code = 0;
  for (int k = 0; k < std::min(d, 3); ++k) code |= fold(sign * shift[k]) << (BITS * k);
  return row << SHIFT_BITS | code;
}
inline std::int64_t row(std::int64_t key) { return key >> SHIFT_BITS; }
/// Whether it is an image and not the particle itself.
inline bool shifted(std::int64_t key) { return (key & ((std::int64_t{1} << SHIFT_BITS) - 1)) != 0; }
inline int shift(std::int64_t key, int k) { return unfold(key >> (BITS * k) & ((1 << BITS) - 1)); }

}  // namespace image

/// A spring seen from one end. self: a row; other: a key.
struct HalfSpring {
  std::int64_t self, other, spring;
  double stiffness, rest_length, damping;
};
struct ParticleRecord {
  std::int64_t row, id;
  double mass, x[3], v[3];
  int fixed;
};
struct AnchorRecord {
  std::int64_t particle, row;
  double point[3], stiffness, rest_length, damping;
};

inline bool before(const HalfSpring& a, const HalfSpring& b) {
  if (a.self != b.self) return a.self < b.self;
  if (a.other != b.other) return a.other < b.other;
  return a.spring < b.spring;
}

/// Where the rows of the input lie: chunk of rank r is [begin[r], begin[r + 1]).
struct Chunks {
  std::vector<std::int64_t> begin;
  int owner(std::int64_t row) const { return static_cast<int>(std::upper_bound(begin.begin(), begin.end(), row) - begin.begin()) - 1; }
};

/// Collective. Where every rank's chunk of particles begins.
PetscErrorCode gather_chunks(MPI_Comm comm, const Lattice& lattice, Chunks* chunks);

/// Collective. out (wanted.size(), width) receives the rows `wanted` (each in [0, rows.total), any order, repeats allowed) of a table
/// (rows.total, width) of which each rank holds its chunk in `values`, in the order of the ranks.
PetscErrorCode fetch_rows(MPI_Comm comm, const Rows& rows, const std::vector<double>& values, int width, const std::vector<std::int64_t>& wanted,
                          std::vector<double>* out);

/// Collective. The springs at each particle of this chunk, for the partitioner: symmetric, as it
/// must be, and without the couplings of `options`, which carry no information on neighbourhood.
PetscErrorCode collect_graph(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options, const Chunks& chunks, RowGraph* graph);

/// Collective. Both ends of every spring at the new owners of the ends, sorted; rank_of[k] owns row k of this chunk. The
/// couplings `options` asks for are added as springs without stiffness.
PetscErrorCode collect_half_springs(MPI_Comm comm, const Lattice& lattice, const NetworkOptions& options, const Chunks& chunks,
                                    const std::vector<int>& rank_of, std::vector<HalfSpring>* mine);

/// Collective. Sends particles and anchors to their new owners; both come out sorted by row.
PetscErrorCode migrate(MPI_Comm comm, const Lattice& lattice, const Chunks& chunks, const std::vector<int>& rank_of,
                       std::vector<ParticleRecord>* particles, std::vector<AnchorRecord>* anchors);

// Sends records to ranks and receives those meant for this one.

/// Collective. make(k), k < count, goes to rank dest(k); `received` is ordered by sending rank, then by k, so the result is
/// reproducible. Record must be trivially copyable.
template <class Record, class Dest, class Make>
PetscErrorCode exchange(MPI_Comm comm, std::size_t count, Dest&& dest, Make&& make, std::vector<Record>* received) {
  static_assert(std::is_trivially_copyable_v<Record>);
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
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
  PetscCall(max_over_ranks(comm, &turns));
  std::vector<Record> received;
  for (unsigned long long turn = 0; turn < turns; ++turn) {
    const std::size_t begin = std::min(count, static_cast<std::size_t>(turn) * slice), end = std::min(count, begin + slice);
    PetscCall(exchange(
        comm, end - begin, [&](std::size_t k) { return dest(begin + k); }, [&](std::size_t k) { return make(begin + k); }, &received));
    PetscCall(take(received));
  }
  PetscFunctionReturn(0);
}

// How much memory a lattice takes while it is read and divided among the ranks.

struct LatticeSize {
  std::int64_t particles = 0, springs = 0, anchors = 0;
  int dim = 3;
};

/// The chunk of a lattice that a rank of `ranks` holds, on average [bytes].
double chunk_bytes(const LatticeSize& size, int ranks);

/// What building the network holds beside the chunk when it holds most, on average: springs seen from both ends, once as they were
/// sent and once in place, and the particles [bytes].
double network_bytes(const LatticeSize& size, int ranks);

/// Both, with a tenth off the second for parts of unequal size: the amount that is checked first. Counted by the arrays that are
/// certainly held at one time.
/// Measured, cubic lattice of 40 x 40 x 40 with 552,240 springs: 118 MB on one rank, where a whole run with the default solver took 140 MB
/// of data (VmData) more than one of 8 particles; 55 MB on each of 2 ranks, of 82 MB (100 MB with -ts_type euler).
double lattice_bytes(const LatticeSize& size, int ranks);

/// Collective. Checks that there is memory for it; `source` names it.
PetscErrorCode reserve_lattice(MPI_Comm comm, const std::string& source, const LatticeSize& size);

// Interactions of several particles, which go to all ranks that own an end of them.

/// An interaction as the owner of one of its ends gets it.
struct InteractionRecord {
  std::int64_t row, end[MOST_ENDS];  ///< keys, of images as seen from the rank's own end
  double parameter[MOST_INTERACTION_PARAMETERS];
  int owned;  ///< which end is this rank's
};

/// Collective. Of each kind, every interaction once for every owned end, ascending by row, then by end; no kinds at all where the
/// lattice has no interactions.
PetscErrorCode collect_interactions(MPI_Comm comm, const Lattice& lattice, const Chunks& chunks, const std::vector<int>& rank_of,
                                    std::vector<std::vector<InteractionRecord>>* kinds);

/// Adds couplings between ends that no spring and no other coupling joins, and sorts `springs` again: ghosts and rows of
/// matrices are made by half springs.
void add_couplings(const std::vector<std::vector<InteractionRecord>>& kinds, std::vector<HalfSpring>* springs);

/// The tables of a network that is laid out: `ghosts` are its ghosts' keys, ascending.
void lay_out_interactions(const Lattice& lattice, const std::vector<std::vector<InteractionRecord>>& kinds, const std::vector<std::int64_t>& ghosts,
                          Network* net);

// What springs and particles carry by columns.

/// What the springs of a chunk take beyond stiffness and rest length, row by row.
class SpringRows {
 public:
  /// The lattice must outlive the object; its columns hold what its laws need.
  explicit SpringRows(const Lattice& lattice);
  int law(std::size_t k) const { return lattice_.law_by_row ? lattice_.spring_laws[k] : static_cast<int>(lattice_.spring_law); }
  /// The row's parameters, then its history, at most SPRING_WIDTH numbers; 0 where the lattice has no such column.
  void fill(std::size_t k, double* more) const;
  /// Its force per length, for estimates [N/m].
  double rate(std::size_t k) const;

 private:
  const Lattice& lattice_;
  std::vector<std::vector<const double*>> columns_;  ///< per law: where its numbers stand; null: nowhere
};

/// The law of anchors: the lattice's, or Hooke's where that one takes more than stiffness and rest length.
int anchor_law(const Lattice& lattice);

/// Collective. Gives the links of `net`, which are laid out, their laws; nothing where all springs are Hooke's or of the strain law.
PetscErrorCode give_laws(MPI_Comm comm, const Lattice& lattice, Network* net);

/// Collective. Gives the owned particles of `net`, which are laid out, the numbers in the lattice's columns.
PetscErrorCode give_columns(MPI_Comm comm, const Lattice& lattice, Network* net);

}  // namespace bs
