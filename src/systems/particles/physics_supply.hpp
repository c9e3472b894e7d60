// What acts from outside on particles, as power; included by physics_impl.hpp alone.
#pragma once
#include <type_traits>
#include "systems/particles/physics_impl.hpp"

namespace bs {

/// Whether a law is the drag of a fluid that may move (it has its velocity, `fluid`).
template <class Law, class = void>
struct has_fluid : std::false_type {};
template <class Law>
struct has_fluid<Law, std::void_t<decltype(std::declval<const Law&>().fluid)>> : std::true_type {};

// Drag f(v - u) takes f.(v - u) out and brings f.u in; a law with a potential brings f.v.
template <int d, class Damper>
template <class Law>
void PhysicsOf<d, Damper>::add_supply(const Law& law, const Point<d>& point, Supply* sum) {
  constexpr bool potential = Law::potential == Potential::linear || Law::potential == Potential::of_position;
  if constexpr (potential || has_fluid<Law>::value) {
    double f[d] = {};
    if (!law.template force<d>(point, f)) return;
    if constexpr (potential) sum->field += dot<d>(f, point.v);
    else sum->fluid += dot<d>(f, law.fluid);
  }
}

template <int d, class Damper>
Supply PhysicsOf<d, Damper>::supply(double t, const LocalState& state, const Coupling& coupling) const {
  const AnchorShift shift(motion_, t);
  Supply sum;
  for (PetscInt i = 0; i < net_.n; ++i) {
    if (net_.fixed[i] == 1) continue;
    const double* y = state.at(i);
    const Point<d> point{t, net_.mass[i], net_.columns(i), y, y + d};
    for_each_law(laws_, [&](const auto& law) {
      if (law.active()) add_supply(law, point, &sum);
    });
    double f[d] = {};
    if (coupling.active()) coupling.add_force<d>(i, point, f);
    sum.coupling += dot<d>(f, point.v);
    if (!motion_.active()) continue;
    double pull[d] = {};
    Singularity none;
    add_anchors(i, y, shift, pull, &none);
    for (int c = 0; c < d; ++c) sum.pull[c] += pull[c];
  }
  return sum;
}

}  // namespace bs
