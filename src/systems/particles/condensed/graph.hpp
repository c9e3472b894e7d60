// A network as linear algebra sees it.
#pragma once
#include <vector>
#include "linalg/pair_matrix.hpp"
#include "network/network.hpp"

namespace bs {

/// Refers to arrays of the network, with what holds its particles as it is now.
Graph graph_of(const Network& net);

/// Which pairs of free particles springs link.
PairPattern pairs_of(const Network& net);

/// Global indices of both ends of every coupling between free particles, as seen from owned ones: springs and interactions.
std::vector<PetscInt> coupled_ends(const Network& net);

}  // namespace bs
