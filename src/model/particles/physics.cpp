#include "model/particles/physics.hpp"
#include "laws/dampers/axial.hpp"
#include "laws/dampers/simple.hpp"
#include "model/particles/interactions/with_interactions.hpp"
#include "model/particles/physics_impl.hpp"

namespace bs {
namespace {

template <int d, class Spring>
std::unique_ptr<Physics> with_damper(const Network& net, const ParticleLaws& laws, const Motion& motion,
                                     const RowPattern& pattern) {
  if (net.damping_law == DampingLaw::simple)
    return std::make_unique<PhysicsOf<d, Spring, SimpleDamper>>(net, laws, motion, pattern);
  return std::make_unique<PhysicsOf<d, Spring, AxialDamper>>(net, laws, motion, pattern);
}

template <int d>
std::unique_ptr<Physics> with_spring(const Network& net, const ParticleLaws& laws, const Motion& motion,
                                     const RowPattern& pattern) {
  if (net.spring_law == SpringLaw::strain) return with_damper<d, StrainSpring>(net, laws, motion, pattern);
  return with_damper<d, HookeSpring>(net, laws, motion, pattern);
}

}  // namespace

std::unique_ptr<Physics> create_physics(const Network& net, const ParticleLaws& laws, const Motion& motion,
                                        const RowPattern& pattern) {
  switch (net.dim) {
    case 1: return with_spring<1>(net, laws, motion, pattern);
    case 2: return with_interactions(net, with_spring<2>(net, laws, motion, pattern));
    default: return with_interactions(net, with_spring<3>(net, laws, motion, pattern));
  }
}

}  // namespace bs
