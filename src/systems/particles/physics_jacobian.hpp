// The rows of the full Jacobian of an owned particle: the second half of the loops in physics_impl.hpp.
#pragma once
#include "systems/particles/physics_impl.hpp"

namespace bs {

// Panel rows are -df_i/dx_j and -df_i/dv_j, side by side for every column j. D null: no part by velocity.
template <int d, class Damper>
void PhysicsOf<d, Damper>::subtract(double* panel, PetscInt width, PetscInt slot, const double* K, const double* D) {
  for (int r = 0; r < d; ++r) {
    double* row = panel + r * width + slot * 2 * d;
    for (int c = 0; c < d; ++c) row[c] -= K[r * d + c];
    if (D)
      for (int c = 0; c < d; ++c) row[d + c] -= D[r * d + c];
  }
}

template <int d, class Damper>
void PhysicsOf<d, Damper>::add_tangents(PetscInt i, double t, const LocalState& state, const Coupling& coupling, const AnchorShift& shift,
                                        double* panel, PetscInt width) const {
  const Links& links = net_.links;
  const double* y = state.at(i);
  const Point<d> point{t, net_.mass[i], net_.columns(i), y, y + d};
  double self_K[d * d] = {}, self_D[d * d] = {};
  with_law(law_[i], [&](auto law) {
    using Link = Kernel<decltype(law)>;
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      double K[d * d] = {}, D[d * d] = {};
      bool damped = true;
      if (links.spring[e] >= 0) {
        const LinkGeometry<d> g(y, state.at(links.other[e]));
        const auto p = parameters<decltype(law)>(links, e, state.time());
        if (!Link::defined(g, p)) continue;
        Link::tangent(g, p, K, D);
        damped = p.damping != 0;
        for (int k = 0; k < d * d; ++k) {
          self_K[k] += K[k];
          self_D[k] += D[k];
          K[k] = -K[k];
          D[k] = -D[k];
        }
      } else {
        coupling.add_cross<d>(i, links.other[e], point, K, D);
      }
      if (pattern_.slot(e) >= 0) subtract(panel, width, pattern_.slot(e), K, damped ? D : nullptr);
    }
  });
  add_node_tangent<false>(i, point, shift, self_K, self_D);
  coupling.add_self<d>(i, point, self_K, self_D);
  subtract(panel, width, pattern_.self(i), self_K, self_D);
}

template <int d, class Damper>
PetscErrorCode PhysicsOf<d, Damper>::jacobian(double t, const LocalState& state, const Coupling& coupling, double sigma, bool momentum,
                                              RowWriter* writer) const {
  const AnchorShift shift(motion_, t);
  std::vector<double> panel(static_cast<std::size_t>(pattern_.widest() * 2 * d * d));
  PetscFunctionBegin;
  for (PetscInt i = 0; i < net_.n; ++i) {
    const PetscInt width = pattern_.count(i) * 2 * d;
    std::fill_n(panel.begin(), width * d, 0.0);
    if (!net_.fixed[i]) add_tangents(i, t, state, coupling, shift, panel.data(), width);
    const double scale = momentum ? 1.0 : 1.0 / net_.mass[i];
    if (!momentum)
      for (PetscInt k = 0; k < width * d; ++k) panel[k] *= scale;
    for (int k = 0; k < d; ++k) panel[k * width + pattern_.self(i) * 2 * d + d + k] += sigma * (momentum ? net_.mass[i] : 1.0);
    PetscCall(writer->write(i, sigma, momentum ? net_.mass[i] : 1.0, panel.data()));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
