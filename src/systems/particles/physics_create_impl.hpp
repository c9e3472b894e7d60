// The choice of loops for one dimension; included by physics_<d>d.cpp alone.
#pragma once
#include "physics/pair/springs/registry.hpp"
#include "systems/particles/physics_create.hpp"
#include "systems/particles/physics_impl.hpp"

namespace bs {

template <int d, class Spring>
std::unique_ptr<Physics> with_damper(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern) {
  if (net.damping_law == DampingLaw::simple) return std::make_unique<PhysicsOf<d, Spring, SimpleDamper>>(net, laws, motion, pattern);
  return std::make_unique<PhysicsOf<d, Spring, AxialDamper>>(net, laws, motion, pattern);
}

template <int d>
std::unique_ptr<Physics> create_physics_of(const Network& net, const ParticleLaws& laws, const Motion& motion, const RowPattern& pattern) {
  if (net.mixed) return with_damper<d, MixedSpring>(net, laws, motion, pattern);
  if (net.spring_law == SpringLaw::strain) return with_damper<d, StrainSpring>(net, laws, motion, pattern);
  return with_damper<d, HookeSpring>(net, laws, motion, pattern);
}

}  // namespace bs
