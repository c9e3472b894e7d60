// Interactions of several ends beside springs and particle laws.
#pragma once
#include <memory>
#include "systems/particles/physics.hpp"

namespace bs {

/// The loops of `pairs` and those over the network's interactions; `pairs` itself where it has none.
std::unique_ptr<Physics> with_interactions(const Network& net, std::unique_ptr<Physics> pairs);

/// Collective. The message for an interaction without a force; `mine`: it occurred on this rank (at least one has it).
PetscErrorCode interaction_fault(MPI_Comm comm, bool mine, const Singularity& fault, std::string* text);

}  // namespace bs
