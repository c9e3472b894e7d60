// Which rank each particle goes to.
#pragma once
#include <petscmat.h>
#include <cstdint>
#include <string>
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

}  // namespace bs
