// Interactions of several ends beside springs and particle laws.
#pragma once
#include <memory>
#include "systems/particles/physics.hpp"

namespace bs {

/// The loops of `pairs` and those over the network's interactions; `pairs` itself where it has none.
std::unique_ptr<Physics> with_interactions(const Network& net, std::unique_ptr<Physics> pairs);

/// Collective. The words for an interaction without a force; `mine`: it is this rank that met it (one at least does).
PetscErrorCode interaction_fault(MPI_Comm comm, bool mine, const Singularity& fault, std::string* text);

}  // namespace bs
