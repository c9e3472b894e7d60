// Physics for one dimension: each in a file of its own, since they take long to compile.
#pragma once
#include <memory>
#include "systems/particles/physics.hpp"

namespace bs {

template <int d>
std::unique_ptr<Physics> create_physics_of(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern);

}  // namespace bs
