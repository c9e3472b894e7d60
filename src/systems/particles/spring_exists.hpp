// Which springs there are, and what couples two particles: a spring that can exert no force is none.
#pragma once
#include "network/network.hpp"
#include "physics/pair/springs/mixed.hpp"
#include "physics/pair/springs/spring.hpp"

namespace bs {

/// Whether the spring of link e can exert a force: it has a rate at some length near its rest length, or a damper. One without, as generators write
/// to dilute a lattice and as breaking leaves it, has no strain, does not break and holds nothing.
inline bool exists(const Network& net, PetscInt e) {
  const Links& links = net.links;
  const std::size_t at = static_cast<std::size_t>(e);
  if (!links.damping.empty() && links.damping[at] != 0) return true;
  if (links.stiffness[at] != 0) return true;
  if (links.law.empty()) return false;
  return spring_rate<MixedSpring>(0.0, links.rest_length[at],
                                  SpringRow{links.law[at], links.more.data() + at * static_cast<std::size_t>(links.width)}) != 0;
}

/// Whether link e ties its ends to each other. What couples without a spring (angle springs) does, too, and where there are angle springs one of them
/// may do so across a spring that is none.
inline bool ties(const Network& net, PetscInt e) { return net.links.spring[e] < 0 || exists(net, e) || !net.interactions.empty(); }

/// Whether assembled matrices have a block for link e of a particle that is not fixed: a broken spring keeps its own, for it may have to be restored,
/// and a continued run has the same matrices.
inline bool has_block(const Network& net, PetscInt e) {
  return !net.fixed[net.links.other[e]] && (net.room || net.links.is_broken(e) || ties(net, e));
}

}  // namespace bs
