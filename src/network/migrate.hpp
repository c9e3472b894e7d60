// Rows of the input on their way to the ranks that will own them.
#pragma once
#include <petscsys.h>
#include <algorithm>
#include <cstdint>
#include <vector>
#include "network/image.hpp"
#include "network/network.hpp"
#include "network/partition.hpp"

namespace bs {

/// A spring seen from one end. self: a row; other: a key (image.hpp).
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

}  // namespace bs
