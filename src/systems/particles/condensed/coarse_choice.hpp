// Which functions the coarse space of the block factors consists of.
#pragma once
#include "network/network.hpp"

namespace bs {

/// Collective. Whether rigid motions of groups of particles suit the lattice better than hats on a grid: where the body, as it starts, is at least
/// THIN times as long as it is thick, so that it bends. Not a line, which incomplete factors solve; not where stiffnesses differ
/// by more than UNEVEN, because motions of groups would strain stiff springs between them.
PetscErrorCode prefers_rigid_motions(const Network& net, bool* rigid);

}  // namespace bs
