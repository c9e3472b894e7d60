// The particle laws. A new law is one header and one line here.
#pragma once
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "physics/body/central_gravity.hpp"
#include "physics/body/linear_drag.hpp"
#include "physics/body/shape_drag.hpp"
#include "physics/body/sphere_drag.hpp"
#include "physics/body/uniform_gravity.hpp"
#include "physics/body/xsp_forces.hpp"

namespace bs {

/// A law that acts as often as its options ask for, each time with numbers of its own: it reads them all (`Law::options(section, list)`).
template <class Law>
struct Several {
  static constexpr const char* title = Law::title;
  std::vector<Law> all = std::vector<Law>(1);

  template <class V>
  void options(V& o) {
    Law::options(o, &all);
  }
};

using ParticleLaws =
    std::tuple<UniformGravity, Several<CentralGravity>, StokesDrag, MassDrag, ParticleDrag, SphereDrag, ShapeDrag, XspAttraction, XspWalls>;

/// Whether a law acts wherever a lattice has its `column`: it has a member `given`, which is set then.
template <class Law, class = void>
struct acts_by_column : std::false_type {};
template <class Law>
struct acts_by_column<Law, std::void_t<decltype(std::declval<Law&>().given)>> : std::true_type {};

/// Whether a law's force depends on Point::t, beside place and velocity: such a law says `static constexpr bool varies_in_time = true`.
template <class Law, class = void>
struct varies_in_time : std::false_type {};
template <class Law>
struct varies_in_time<Law, std::void_t<decltype(Law::varies_in_time)>> : std::bool_constant<Law::varies_in_time> {};

/// Whether a law is the drag of a fluid, whose own velocity is the same everywhere. A law without any potential is taken for one.
template <class Law>
inline constexpr bool is_drag = Law::potential == Potential::of_velocity || Law::potential == Potential::none;

/// Whether a law's force grows with the load factor of static analyses: it has a member `load`, to which that is written.
template <class Law, class = void>
struct has_load : std::false_type {};
template <class Law>
struct has_load<Law, std::void_t<decltype(std::declval<Law&>().load)>> : std::true_type {};

template <class T>
struct is_several : std::false_type {};
template <class Law>
struct is_several<Several<Law>> : std::true_type {};

/// All laws read their options.
template <class Laws, class V>
void read_options(Laws& laws, V& o) {
  std::apply([&](auto&... law) { (law.options(o), ...); }, laws);
}

/// Calls f(law) for each law in the tuple, in its order, as often as it acts; `laws` may be const.
template <class Laws, class F>
void for_each_law(Laws& laws, F&& f) {
  const auto use = [&](auto& law) {
    if constexpr (is_several<std::decay_t<decltype(law)>>::value)
      for (auto& one : law.all) f(one);
    else f(law);
  };
  std::apply([&](auto&... law) { (use(law), ...); }, laws);
}

}  // namespace bs
