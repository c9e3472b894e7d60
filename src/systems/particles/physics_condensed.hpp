// The loops of PairForcesOf that make S and multiply by the tangent; included by physics_impl.hpp alone.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>
#include "linalg/lanes.hpp"
#include "network/network.hpp"
#include "systems/particles/physics_impl.hpp"

namespace bs {

// Pairs of S of a particle that is tied by springs alone to free particles of its rank, four at a time.

/// Places of the links of owned particle i that are its pairs in S, those to higher particles. False where the links are not all to free particles of
/// this rank, or not one to a pair, or more than `room`.
inline bool list_pairs(const Network& net, PetscInt i, PetscInt pairs, PetscInt room, PetscInt* places) noexcept {
  const PetscInt begin = net.links.start[i], end = net.links.start[i + 1];
  if (end - begin > room) return false;
  PetscInt count = 0;
  bool held = false;
  for (PetscInt e = begin; e < end; ++e) {
    const PetscInt j = net.links.other[e];
    held = held || j >= net.n || net.fixed[j];
    places[count] = e;
    count += j > i;
  }
  return !held && count == pairs;
}

/// The numbers (w, t) of four pairs: B = t I + w w^T, t = c T/l, w = sqrt(c (T' - T/l)) dx/l, with the formulas of add_to_pair. `places`: of
/// their links; the first `count` are written to `to`. False, and nothing is written, where ends coincide.
template <class Spring, bool positive>
inline bool fill_four(const Links& links, const PetscInt* places, int count, lanes::Vector<3> here, const double* states, double c,
                      float* to) noexcept {
  using Four = lanes::Vector<3>;
  Four dx[4], l, K, L, root;
  for (int k = 0; k < 4; ++k) {
    const PetscInt e = places[std::min(k, count - 1)];
    dx[k] = here - lanes::load<3>(Layout{3}.of(states, links.other[e]));
    K[k] = links.stiffness[e];
    L[k] = links.rest_length[e];
  }
  const Four a = __builtin_shufflevector(dx[0], dx[1], 0, 4, 2, 6), b = __builtin_shufflevector(dx[2], dx[3], 0, 4, 2, 6);
  const Four s = __builtin_shufflevector(dx[0], dx[1], 1, 5, 3, 7), u = __builtin_shufflevector(dx[2], dx[3], 1, 5, 3, 7);
  const Four x = __builtin_shufflevector(a, b, 0, 1, 4, 5), y = __builtin_shufflevector(s, u, 0, 1, 4, 5),
             z = __builtin_shufflevector(a, b, 2, 3, 6, 7);
  const Four square = x * x + y * y + z * z;
  for (int k = 0; k < 4; ++k) l[k] = std::sqrt(square[k]);
  if (!(l[0] > 0 && l[1] > 0 && l[2] > 0 && l[3] > 0)) return false;
  Four across = Spring::tension_over_length(l, K, L) * c;
  if (positive) across = across < 0 ? Four{} : across;
  Four along = Spring::stiffness(l, K, L) * c - across;
  along = along > 0 ? along : Four{};
  for (int k = 0; k < 4; ++k) root[k] = std::sqrt(along[k]);
  const Four scale = root / l;
  for (int k = 0; k < count; ++k) {
    Four numbers = dx[k] * scale[k];
    numbers[3] = across[k];
    const auto rounded = __builtin_convertvector(numbers, lanes::Register<float, 4>::type);
    std::memcpy(to + 4 * k, &rounded, sizeof rounded);
  }
  return true;
}

/// All pairs of owned particle i; false where they have to be made one by one. c: what the springs' rates are multiplied by; `to`: zeros, as after
/// false.
template <class Spring, bool positive>
inline bool fill_plain_pairs(const Network& net, PetscInt i, PetscInt pairs, const double* states, double c, float* to) noexcept {
  constexpr PetscInt ROOM = 64;
  PetscInt places[ROOM + 1];
  if (!list_pairs(net, i, pairs, ROOM, places)) return false;
  const lanes::Vector<3> here = lanes::load<3>(Layout{3}.of(states, i));
  for (PetscInt k = 0; k < pairs; k += 4)
    if (!fill_four<Spring, positive>(net.links, places + k, static_cast<int>(std::min<PetscInt>(4, pairs - k)), here, states, c, to + 4 * k)) {
      std::fill_n(to, 4 * pairs, 0.0F);
      return false;
    }
  return true;
}

namespace condensed {

/// What the rate across a link, T/l, is more with a predicted tension in place of its own [N/m]. tensions: of all links, or null.
template <class Kernel, bool positive, int d>
inline double correction(const double* tensions, PetscInt e, const LinkGeometry<d>& g, const typename Kernel::Parameters& p) noexcept {
  if (!tensions || std::isnan(tensions[e])) return 0;
  const double predicted = tensions[e] / g.length, own = Kernel::tension(g, p) / g.length;
  return positive ? std::max(predicted, 0.0) - std::max(own, 0.0) : predicted - own;
}

/// B += t I + (a - t) u u^T of one link, a and t its rates along and across: the part of -(b D + c K) that has this form.
template <int d>
inline void add_link(const LinkGeometry<d>& g, const SpringTangent& rate, double* B) noexcept {
  double u[d];
  for (int c = 0; c < d; ++c) u[c] = g.length > 0 ? g.dx[c] / g.length : 0;
  add_tensor<d>(rate.transverse, rate.axial - rate.transverse, u, B);
}

/// Adds a link to the numbers (w, t) of its pair: B = t I + a u u^T, w = sqrt(a) u. Links of one pair share u. A damper's
/// force also depends on where its ends are; what of that is not of this form is left out, as are rates along that are less than
/// those across (laws that soften): then B = t I, on a line with the rate along it.
template <int d>
inline void add_to_pair(const LinkGeometry<d>& g, const SpringTangent& rate, float* pair) noexcept {
  double along = rate.axial - rate.transverse;
  for (int c = 0; c < d; ++c) along += static_cast<double>(pair[c]) * static_cast<double>(pair[c]);
  const double scale = along > 0 && g.length > 0 ? std::sqrt(along) / g.length : 0;
  for (int c = 0; c < d; ++c) pair[c] = static_cast<float>(scale * g.dx[c]);
  pair[d] += static_cast<float>(d == 1 && along < 0 ? rate.transverse + along : rate.transverse);
}

/// What goes into a symmetric matrix.
template <int d, class Real>
inline void add_symmetric(const double* B, Real* to) noexcept {
  for (int r = 0; r < d; ++r)
    for (int c = 0; c < d; ++c) to[r * d + c] += static_cast<Real>(0.5 * (B[r * d + c] + B[c * d + r]));
}

}  // namespace condensed

// A_i = a m_i - b D_i - c K_i of particle laws and anchors
template <int d, class Damper>
template <bool positive>
void PairForcesOf<d, Damper>::node_block(PetscInt i, double t, const LocalState& state, const AnchorShift& shift, const Coefficients& abc,
                                         double* A) const {
  std::fill_n(A, d * d, 0.0);
  for (int c = 0; c < d; ++c) A[c * (d + 1)] = abc.mass * net_.inertia[i];
  if (net_.fixed[i]) return;
  double K[d * d] = {}, D[d * d] = {};
  add_node_tangent<positive>(i, point_of(i, t, state), shift, K, D);
  for (int k = 0; k < d * d; ++k) A[k] -= abc.damping * D[k] + abc.stiffness * K[k];
}

// Links of a row come in the pattern's order: each fills the next pair, or the one before it if it runs parallel.
template <int d, class Damper>
template <class Spring, bool positive>
void PairForcesOf<d, Damper>::fill_pairs(PetscInt i, const LocalState& state, const Coefficients& abc, double* node, PairPlaces* at,
                                         PairMatrix* S) const {
  using Link = Kernel<Spring>;
  const Links& links = net_.links;
  if constexpr (d == 3 && !Spring::mixed) {
    const PairPattern& pattern = S->pattern();
    const PetscInt pairs = pattern.start[i + 1] - pattern.start[i];
    if (plain_[i] && !state.tensions() && fill_plain_pairs<Spring, positive>(net_, i, pairs, state.at(0), abc.stiffness, S->pair(at->pair + 1))) {
      at->pair += pairs;
      return;
    }
  }
  const double* y = state.at(i);
  PetscInt last = -1;
  for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) {
    const PetscInt j = net_.coupled(i, e);
    const bool held = net_.fixed[j];
    if (links.spring[e] < 0 || (!held && (j < i || net_.own_image(i, links.other[e])))) continue;
    if (!held && j != last) ++(j < net_.n ? at->pair : at->cut);
    if (!held) last = j;
    const LinkGeometry<d> g(y, state.at(links.other[e]));
    const auto p = parameters<Spring>(links, e, state.time());
    if (!Link::defined(g, p)) continue;
    SpringTangent rate = Link::template rates<positive>(g, p, abc.damping, abc.stiffness);
    rate.transverse += abc.stiffness * condensed::correction<Link, positive>(state.tensions(), e, g, p);
    if (held) condensed::add_link<d>(g, rate, node);
    else condensed::add_to_pair<d>(g, rate, j < net_.n ? S->pair(at->pair) : S->cut(at->cut));
  }
}

template <int d, class Damper>
template <bool positive>
void PairForcesOf<d, Damper>::fill_springs(double t, const LocalState& state, const Coefficients& abc, PairMatrix* S) const {
  const AnchorShift shift(motion_, t);
  PairPlaces at;
  S->zero();
  for (PetscInt i = 0; i < net_.n; ++i) {
    double node[d * d];
    node_block<positive>(i, t, state, shift, abc, node);
    if (!net_.fixed[i]) with_law(law_[i], [&](auto law) { fill_pairs<decltype(law), positive>(i, state, abc, node, &at, S); });
    condensed::add_symmetric<d>(node, S->node(i));
  }
}

template <int d, class Damper>
template <bool positive>
PetscErrorCode PairForcesOf<d, Damper>::fill_rows(double t, const LocalState& state, const Coefficients& abc, RowWriter* writer) const {
  const AnchorShift shift(motion_, t);
  std::vector<double> panel(static_cast<std::size_t>(pattern_.widest() * d * d));
  PetscFunctionBegin;
  for (PetscInt i = 0; i < net_.n; ++i) {
    const PetscInt width = pattern_.count(i) * d;
    std::fill_n(panel.begin(), width * d, 0.0);
    double node[d * d];
    node_block<positive>(i, t, state, shift, abc, node);
    if (!net_.fixed[i])
      for_links(i, state, [&](auto kernel, PetscInt e, const LinkGeometry<d>& g, const auto& p) {
        double B[d * d] = {};
        SpringTangent rate = kernel.template rates<positive>(g, p, abc.damping, abc.stiffness);
        rate.transverse += abc.stiffness * condensed::correction<decltype(kernel), positive>(state.tensions(), e, g, p);
        condensed::add_link<d>(g, rate, B);
        const PetscInt slot = pattern_.slot(e);
        for (int r = 0; r < d; ++r)
          for (int c = 0; c < d; ++c) {
            node[r * d + c] += B[r * d + c];
            if (slot >= 0) panel[r * width + slot * d + c] -= B[r * d + c];
          }
      });
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) panel[r * width + pattern_.self(i) * d + c] += 0.5 * (node[r * d + c] + node[c * d + r]);
    PetscCall(writer->write(i, (abc.mass > 0 ? abc.mass : 1) * net_.inertia[i], panel.data()));
  }
  PetscFunctionReturn(0);
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::stiffness_sizes(double t, const LocalState& state, double* size) const {
  const AnchorShift shift(motion_, t);
  for (PetscInt i = 0; i < net_.n; ++i) {
    double node[d * d];
    node_block<false>(i, t, state, shift, {0, 0, 1}, node);
    size[i] = 0;
    for (int c = 0; c < d; ++c) size[i] += std::abs(node[c * (d + 1)]);
    if (net_.fixed[i]) continue;
    for_links(i, state, [&](auto kernel, PetscInt, const LinkGeometry<d>& g, const auto& p) {
      const SpringTangent rate = kernel.rates(g, p, 0, 1);
      size[i] += std::max(kernel.rate(p), std::abs(rate.axial)) + (d - 1) * std::abs(rate.transverse);
    });
  }
}

/// f += df_i/dx_i (z_i - z_j) and the same of velocities, of the springs of particle i.
template <int d, class Damper>
void PairForcesOf<d, Damper>::add_products(PetscInt i, const LocalState& state, const LocalState& z, double* f) const {
  const double* zi = z.at(i);
  for_links(i, state, [&](auto kernel, PetscInt e, const LinkGeometry<d>& g, const auto& p) {
    double K[d * d] = {}, D[d * d] = {};
    kernel.tangent(g, p, K, D);
    if (const double more = condensed::correction<decltype(kernel), false>(state.tensions(), e, g, p); more != 0) {
      double u[d];
      for (int c = 0; c < d; ++c) u[c] = g.dx[c] / g.length;
      add_tensor<d>(-more, more, u, K);
    }
    const double* zj = z.at(net_.links.other[e]);
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) f[r] += K[r * d + c] * (zi[c] - zj[c]) + D[r * d + c] * (zi[d + c] - zj[d + c]);
  });
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const {
  const AnchorShift shift(motion_, t);
  for (PetscInt i = 0; i < net_.n; ++i) {
    double* fi = f + i * d;
    std::fill_n(fi, d, 0.0);
    if (net_.fixed[i]) continue;
    add_products(i, state, z, fi);
    const double* zi = z.at(i);
    // a node block with sigma = 1 and without mass, for K and D apart
    double K[d * d] = {}, D[d * d] = {};
    add_node_tangent<false>(i, point_of(i, t, state), shift, K, D);
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) fi[r] += K[r * d + c] * zi[c] + D[r * d + c] * zi[d + c];
  }
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::multiply_law_damping(double t, const LocalState& state, const double* w, double* f) const {
  const AnchorShift shift(motion_, t);
  for (PetscInt i = 0; i < net_.n; ++i) {
    if (net_.fixed[i]) continue;
    double K[d * d] = {}, D[d * d] = {};
    add_node_tangent<false>(i, point_of(i, t, state), shift, K, D);
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) f[i * d + r] += D[r * d + c] * w[i * d + c];
  }
}

}  // namespace bs
