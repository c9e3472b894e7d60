// Tensions of springs behind a change of their ends' places, to first order; included by physics_impl.hpp alone.
//
// A bar that turns by an angle a grows by a^2/2 along the straight way. Where it is stiff, that strain exerts forces far above those that turn it,
// and a tangent that takes them for its geometric stiffness T/l (I - u u^T) says next to nothing about the next correction. The tension that Newton's
// linear system asks for, T + T' u.(z_i - z_j), has no such part, and is the tension of the iterate that the next corrections lead to: this is
// Newton's method with the tensions as unknowns of their own, eliminated spring by spring (Magisano, Leonetti, Garcea: Comput. Methods Appl. Mech.
// Engrg. 313, 2017).
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include "systems/particles/physics_impl.hpp"

namespace bs {

template <int d, class Damper>
void PairForcesOf<d, Damper>::predict_tensions(const LocalState& state, const LocalState& z, double part, double* tension) const {
  const Links& links = net_.links;
  std::fill_n(tension, links.other.size(), std::numeric_limits<double>::quiet_NaN());
  const double* former = state.tensions();
  for (PetscInt i = 0; i < net_.n; ++i) {
    if (net_.fixed[i]) continue;
    for_links(i, state, [&](auto kernel, PetscInt e, const LinkGeometry<d>& g, const auto& p) {
      if (p.rest_length == 0) return;
      const double *zi = z.at(i), *zj = z.at(links.other[e]);
      double along = 0;
      for (int c = 0; c < d; ++c) along += g.dx[c] / g.length * (zi[c] - zj[c]);
      const double own = kernel.tension(g, p), from = former ? former[e] : own;
      tension[e] = from + part * (own + kernel.rates(g, p, 0, 1).axial * along - from);
    });
  }
}

template <int d, class Damper>
double PairForcesOf<d, Damper>::largest_turn(const LocalState& state, const LocalState& z) const {
  double most = 0;
  for (PetscInt i = 0; i < net_.n; ++i) {
    if (net_.fixed[i]) continue;
    for_links(i, state, [&](auto kernel, PetscInt e, const LinkGeometry<d>& g, const auto& p) {
      if (p.rest_length == 0 || !kernel.acts(p)) return;
      const double *zi = z.at(i), *zj = z.at(net_.links.other[e]);
      double square = 0;
      for (int c = 0; c < d; ++c) square += (zi[c] - zj[c]) * (zi[c] - zj[c]);
      most = std::max(most, std::sqrt(square) / g.length);
    });
  }
  return most;
}

}  // namespace bs
