// The laws of springs and of dampers by name. A new law is one header and one line here: readers, options, -help, header lines,
// trajectories, checkpoints and the loops take names, parameters and history from these lists. Append: a law's place in the list
// is part of the fingerprints in checkpoints.
#pragma once
#include <tuple>
#include <utility>
#include "lattice/spring_laws.hpp"
#include "physics/pair/dampers.hpp"
#include "physics/pair/springs/maxwell.hpp"
#include "physics/pair/springs/plastic.hpp"
#include "physics/pair/springs/polynomial.hpp"
#include "physics/pair/springs/spring.hpp"
#include "physics/pair/springs/tension.hpp"

namespace bs {

using SpringLaws = std::tuple<HookeSpring, StrainSpring, TensionSpring, PolynomialSpring, PlasticSpring, MaxwellSpring>;
using DamperLaws = std::tuple<AxialDamper, SimpleDamper>;

template <class F, std::size_t... I>
inline void with_spring_law(int place, F&& f, std::index_sequence<I...>) {
  (void)((place == static_cast<int>(I) ? (f(std::tuple_element_t<I, SpringLaws>{}), true) : false) || ...);
}

/// Calls f(law) with the law at `place` of the list.
template <class F>
inline void with_spring_law(int place, F&& f) {
  with_spring_law(place, std::forward<F>(f), std::make_index_sequence<std::tuple_size_v<SpringLaws>>{});
}

}  // namespace bs
