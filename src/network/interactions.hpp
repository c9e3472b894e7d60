// Interactions of several particles on their way to the ranks that own an end of them.
#pragma once
#include <vector>
#include "lattice/spring_laws.hpp"
#include "network/migrate.hpp"

namespace bs {

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

}  // namespace bs
