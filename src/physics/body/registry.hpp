// The particle laws. A new law is one header and one line here.
#pragma once
#include <tuple>
#include <type_traits>
#include <utility>

#include "physics/body/central_gravity.hpp"
#include "physics/body/linear_drag.hpp"
#include "physics/body/shape_drag.hpp"
#include "physics/body/sphere_drag.hpp"
#include "physics/body/uniform_gravity.hpp"
#include "physics/body/xsp_forces.hpp"

namespace bs {

using ParticleLaws = std::tuple<UniformGravity, CentralGravity, StokesDrag, MassDrag, ParticleDrag, SphereDrag, ShapeDrag, XspAttraction, XspWalls>;

/// Whether a law acts wherever a lattice has its `column`; the law is told by its `given`.
template <class Law, class = void>
struct acts_by_column : std::false_type {};
template <class Law>
struct acts_by_column<Law, std::void_t<decltype(std::declval<Law&>().given)>> : std::true_type {};

/// Whether a law's force depends on Point::t, beside place and velocity: such a law says `static constexpr bool varies_in_time = true`.
template <class Law, class = void>
struct varies_in_time : std::false_type {};
template <class Law>
struct varies_in_time<Law, std::void_t<decltype(Law::varies_in_time)>> : std::bool_constant<Law::varies_in_time> {};

/// Calls f(law) for each law in the tuple, in its order; `laws` may be const.
template <class Laws, class F>
void for_each_law(Laws& laws, F&& f) {
  std::apply([&](auto&... law) { (f(law), ...); }, laws);
}

}  // namespace bs
