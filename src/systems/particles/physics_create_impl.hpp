// The choice of loops for one dimension; included by physics_<d>d.cpp alone.
#pragma once
#include "physics/pair/springs/registry.hpp"
#include "systems/particles/physics_create.hpp"
#include "systems/particles/physics_impl.hpp"

namespace bs {

template <int d>
std::unique_ptr<Physics> create_physics_of(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern) {
  if (net.damping_law == DampingLaw::simple) return std::make_unique<PhysicsOf<d, SimpleDamper>>(net, laws, motion, pattern);
  return std::make_unique<PhysicsOf<d, AxialDamper>>(net, laws, motion, pattern);
}

}  // namespace bs
