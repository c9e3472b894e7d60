// Bodies that nothing holds: particles tied to one another, but to no fixed particle and no anchor.
#pragma once
#include <cstdint>
#include <vector>
#include "network/ghost_copies.hpp"
#include "network/network.hpp"

namespace bs {

struct FreeBodies {
  PetscInt count = 0;
  std::int64_t driven_row = -1;  ///< smallest row in the input of a particle of a body that is driven; -1: none is
};

/// Collective. label: (n) the smallest global index in the particle's body, the same on every rank that has a part of it.
PetscErrorCode label_bodies(const Network& net, GhostCopies* copies, std::vector<double>* label);

/// Bit c of each owned particle: something beyond its body holds it along axis c.
std::vector<std::uint8_t> held_axes(const Network& net);

/// Collective. `load`: (n, d) forces that depend on neither place nor time; a body is driven where theirs add up to more than rounding.
PetscErrorCode find_free_bodies(const Network& net, const std::vector<double>& load, FreeBodies* out);

}  // namespace bs
