// The loops of PairForcesOf that sum forces, energies and the power of what acts from outside, and the rows of the full Jacobian; included by
// physics_impl.hpp alone.
#pragma once
#include <algorithm>
#include <limits>
#include <type_traits>
#include "systems/particles/physics_impl.hpp"

namespace bs {

template <int d, class Damper>
template <bool with_energy>
void PairForcesOf<d, Damper>::forces_of(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const {
  const AnchorShift shift(motion_, t);
  for (const PetscInt i : rows_[static_cast<int>(part)]) {
    double* fi = f + i * d;
    std::fill_n(fi, d, 0.0);
    if (with_energy && (!plain_[i] || net_.fixed[i])) add_link_energies(i, state, sum);
    if (!net_.fixed[i]) {
      const Singularity found = force_on<with_energy>(i, t, state, shift, fi, sum);
      if (found.kind != Singularity::none) {
        if (fault->kind == Singularity::none) *fault = found;
        std::fill_n(fi, d, std::numeric_limits<double>::infinity());
      }
    }
    if (with_energy) add_body_energies(i, t, state, shift, sum);
  }
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::energies(double t, const LocalState& state, Energies* sum) const {
  const AnchorShift shift(motion_, t);
  for (const std::vector<PetscInt>& part : rows_)
    for (const PetscInt i : part) {
      add_link_energies(i, state, sum);
      add_body_energies(i, t, state, shift, sum);
    }
}

/// Half a spring from either end, by the loop that sums forces: the same bits.
template <int d, class Damper>
void PairForcesOf<d, Damper>::add_link_energies(PetscInt i, const LocalState& state, Energies* sum) const {
  const double* y = state.at(i);
  with_law(law_[i], [&](auto law) {
    using Spring = decltype(law);
    double unused[d] = {}, plain = 0;
    if constexpr (!Spring::mixed)
      if (plain_[i]) (void)add_plain_links<d, Spring, true>(net_.links, i, y, state.at(0), unused, &plain);
    sum->elastic += 0.5 * plain;
    for (PetscInt e = net_.links.start[i]; e < net_.links.start[i + 1] && !plain_[i]; ++e)
      sum->elastic += 0.5 * Kernel<Spring>::energy({y, state.at(net_.links.other[e])}, parameters<Spring>(net_.links, e, state.time()));
  });
}

/// What the anchors of particle i, its motion and the particle laws add.
template <int d, class Damper>
void PairForcesOf<d, Damper>::add_body_energies(PetscInt i, double t, const LocalState& state, const AnchorShift& shift, Energies* sum) const {
  const double* y = state.at(i);
  for_anchors(i, y, shift, [&](auto kernel, PetscInt, const LinkGeometry<d>& g, const auto& p) { sum->elastic += kernel.energy(g, p); });
  if (net_.fixed[i] == 1) return;  // at rest: driven ones have energies that change
  // one addition to each sum: they depend on those of the particle before
  double x[3] = {0, 0, 0}, p[3] = {0, 0, 0}, square = 0, field = 0;
  for (int c = 0; c < d; ++c) {
    x[c] = y[c];
    p[c] = net_.inertia[i] * y[d + c];
    square += y[d + c] * y[d + c];
  }
  sum->kinetic += 0.5 * net_.inertia[i] * square;
  for (int c = 0; c < 3; ++c) {
    sum->momentum[c] += p[c];
    sum->angular_momentum[c] += x[(c + 1) % 3] * p[(c + 2) % 3] - x[(c + 2) % 3] * p[(c + 1) % 3];
  }
  const Point<d> point = point_of(i, t, state);
  for_each_law(laws_, [&](const auto& law) {
    if (law.active()) field += law.template energy<d>(point);
  });
  sum->field += field;
}

/// Whether a law is the drag of a fluid that may move (it has its velocity, `fluid`).
template <class Law, class = void>
struct has_fluid : std::false_type {};
template <class Law>
struct has_fluid<Law, std::void_t<decltype(std::declval<const Law&>().fluid)>> : std::true_type {};

// Drag f(v - u) takes f.(v - u) out and brings f.u in; a law with a potential brings f.v.
template <int d, class Damper>
template <class Law>
void PairForcesOf<d, Damper>::add_supply(const Law& law, const Point<d>& point, Supply* sum) {
  constexpr bool potential = Law::potential == Potential::linear || Law::potential == Potential::of_position;
  if constexpr (potential || has_fluid<Law>::value) {
    double f[d] = {};
    if (!law.template force<d>(point, f)) return;
    if constexpr (potential) sum->field += dot<d>(f, point.v);
    else sum->fluid += dot<d>(f, law.fluid);
  }
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::supply(double t, const LocalState& state, Supply* sum) const {
  const AnchorShift shift(motion_, t);
  for (PetscInt i = 0; i < net_.n; ++i) {
    if (net_.fixed[i] == 1) continue;
    const double* y = state.at(i);
    const Point<d> point = point_of(i, t, state);
    for_each_law(laws_, [&](const auto& law) {
      if (law.active()) add_supply(law, point, sum);
    });
    if (!motion_.active()) continue;
    double pull[d] = {};
    Singularity none;
    add_anchors(i, y, shift, pull, &none);
    for (int c = 0; c < d; ++c) sum->pull[c] += pull[c];
  }
}

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
  constexpr Layout at{d};
  std::vector<double> panel(static_cast<std::size_t>(at.x(pattern_.widest()) * d));
  PetscFunctionBegin;
  for (PetscInt i = 0; i < net_.n; ++i) {
    const PetscInt width = at.x(pattern_.count(i));
    std::fill_n(panel.begin(), width * d, 0.0);
    if (!net_.fixed[i]) {
      add_tangents(i, t, state, shift, panel.data(), width);
      for (const Term* term : terms) term->add_row(i, t, state, panel.data(), width);
    }
    const double scale = momentum ? 1.0 : 1.0 / net_.inertia[i];
    if (!momentum)
      for (PetscInt k = 0; k < width * d; ++k) panel[k] *= scale;
    for (int k = 0; k < d; ++k) panel[k * width + at.v(pattern_.self(i), k)] += sigma * (momentum ? net_.inertia[i] : 1.0);
    PetscCall(writer->write(i, sigma, momentum ? net_.inertia[i] : 1.0, panel.data()));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
