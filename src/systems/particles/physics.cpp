#include "systems/particles/physics.hpp"
#include "systems/particles/interactions/with_interactions.hpp"

namespace bs {

std::unique_ptr<Physics> create_physics(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern) {
  switch (net.dim) {
    case 1: return create_physics_of<1>(net, laws, motion, pattern);
    case 2: return with_interactions(net, create_physics_of<2>(net, laws, motion, pattern));
    default: return with_interactions(net, create_physics_of<3>(net, laws, motion, pattern));
  }
}

}  // namespace bs
