// How much memory a lattice takes while it is read and divided among the ranks.
#pragma once
#include <petscsys.h>

#include <cstdint>
#include <string>

namespace bs {

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

}  // namespace bs
