// The rows of the full Jacobian of an owned particle: the second half of the loops in physics_impl.hpp.
#pragma once
#include "systems/particles/physics_impl.hpp"

namespace bs {

template <int d, class Damper>
void PairForcesOf<d, Damper>::add_tangents(PetscInt i, double t, const LocalState& state, const AnchorShift& shift, double* panel,
                                           PetscInt width) const {
  const Links& links = net_.links;
  const double* y = state.at(i);
  const Point<d> point = point_of(i, t, state);
  double self_K[d * d] = {}, self_D[d * d] = {};
  with_law(law_[i], [&](auto law) {
    using Link = Kernel<decltype(law)>;
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
      if (links.spring[e] < 0) continue;
      double K[d * d] = {}, D[d * d] = {};
      const LinkGeometry<d> g(y, state.at(links.other[e]));
      const auto p = parameters<decltype(law)>(links, e, state.time());
      if (!Link::defined(g, p)) continue;
      Link::tangent(g, p, K, D);
      for (int k = 0; k < d * d; ++k) {
        self_K[k] += K[k];
        self_D[k] += D[k];
        K[k] = -K[k];
        D[k] = -D[k];
      }
      if (pattern_.slot(e) >= 0) subtract_blocks<d>(panel, width, pattern_.slot(e), K, p.damping != 0 ? D : nullptr);
    }
  });
  add_node_tangent<false>(i, point, shift, self_K, self_D);
  subtract_blocks<d>(panel, width, pattern_.self(i), self_K, self_D);
}

template <int d, class Damper>
PetscErrorCode PairForcesOf<d, Damper>::jacobian(double t, const LocalState& state, const std::vector<Term*>& terms, double sigma, bool momentum,
                                                 RowWriter* writer) const {
  const AnchorShift shift(motion_, t);
  std::vector<double> panel(static_cast<std::size_t>(pattern_.widest() * 2 * d * d));
  PetscFunctionBegin;
  for (PetscInt i = 0; i < net_.n; ++i) {
    const PetscInt width = pattern_.count(i) * 2 * d;
    std::fill_n(panel.begin(), width * d, 0.0);
    if (!net_.fixed[i]) {
      add_tangents(i, t, state, shift, panel.data(), width);
      for (const Term* term : terms) term->add_row(i, t, state, panel.data(), width);
    }
    const double scale = momentum ? 1.0 : 1.0 / net_.inertia[i];
    if (!momentum)
      for (PetscInt k = 0; k < width * d; ++k) panel[k] *= scale;
    for (int k = 0; k < d; ++k) panel[k * width + pattern_.self(i) * 2 * d + d + k] += sigma * (momentum ? net_.inertia[i] : 1.0);
    PetscCall(writer->write(i, sigma, momentum ? net_.inertia[i] : 1.0, panel.data()));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
