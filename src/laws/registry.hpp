// The particle laws. A new law is one header and one line here.
#pragma once
#include <tuple>

#include "laws/central_gravity.hpp"
#include "laws/mass_drag.hpp"
#include "laws/shape_drag.hpp"
#include "laws/sphere_drag.hpp"
#include "laws/stokes_drag.hpp"
#include "laws/uniform_gravity.hpp"
#include "laws/xsp_attraction.hpp"
#include "laws/xsp_walls.hpp"

namespace bs {

using ParticleLaws =
    std::tuple<UniformGravity, CentralGravity, StokesDrag, MassDrag, SphereDrag, ShapeDrag, XspAttraction, XspWalls>;

/// Calls f(law) for each law in the tuple, in its order; `laws` may be const.
template <class Laws, class F>
void for_each_law(Laws& laws, F&& f) {
  std::apply([&](auto&... law) { (f(law), ...); }, laws);
}

}  // namespace bs
