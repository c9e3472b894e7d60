// What single springs and anchors are at a state, and to first order behind a change of it: lengths, tensions, rates, histories, and the stress they
// make in a periodic box; included by physics_impl.hpp alone.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include "linalg/lanes.hpp"
#include "systems/particles/physics_impl.hpp"

namespace bs {

template <int d, class Damper>
double PairForcesOf<d, Damper>::anchor_tension(double t, const LocalState& state, PetscInt k) const {
  const AnchorShift shift(motion_, t);
  const AnchorEnd<d> end(shift, net_.anchors, k);
  return with_law(anchor_law_, [&](auto law) {
    return Kernel<decltype(law)>::tension({state.at(net_.anchors.particle[k]), end.y}, parameters<decltype(law)>(net_.anchors, k, 0));
  });
}

// Both copies of a spring, at its two ends, come to the same history in every bit, on whatever ranks they are: they begin with the
// same numbers, and l is the same from dx and from -dx, whose squares are equal.
template <int d, class Damper>
void PairForcesOf<d, Damper>::commit(const LocalState& state, double h, Links* links) const {
  for (PetscInt i = 0; i < net_.n && net_.mixed; ++i)
    for (PetscInt e = links->start[i]; e < links->start[i + 1]; ++e) {
      if (links->spring[e] < 0) continue;
      const LinkGeometry<d> g(state.at(i), state.at(links->other[e]));
      MixedSpring::commit(g.length, links->stiffness[e], links->rest_length[e], links->law[e],
                          links->more.data() + static_cast<std::size_t>(e) * links->width, h);
    }
}

template <int d, class Damper>
LinkMeasures PairForcesOf<d, Damper>::measure(const LocalState& state, PetscInt i, PetscInt e) const {
  return with_law(law_[i], [&](auto law) -> LinkMeasures {
    using Link = Kernel<decltype(law)>;
    const LinkGeometry<d> g(state.at(i), state.at(net_.links.other[e]));
    const auto p = parameters<decltype(law)>(net_.links, e, state.time());
    return {g.length, Link::tension(g, p), Link::energy(g, p), Link::dissipated(p)};
  });
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::measure(const LocalState& state, std::size_t count, const PetscInt* i, const PetscInt* e, double* length,
                                      double* tension) const {
  for (std::size_t s = 0; s < count;) {
    std::size_t end = s + 1;
    while (end < count && law_[i[end]] == law_[i[s]]) ++end;
    with_law(law_[i[s]], [&](auto law) {
      for (; s < end; ++s) {
        LinkGeometry<d> g(state.at(i[s]), state.at(net_.links.other[e[s]]));
        if constexpr (d == 3) {  // with the bits of a spring that is measured alone
          const lanes::Vector<2> square = lanes::Vector<2>{g.dx[0], g.dx[1]} * lanes::Vector<2>{g.dx[0], g.dx[1]};
          g.length = std::sqrt(g.dx[2] * g.dx[2] + (square[0] + square[1]));
        }
        length[s] = g.length;
        tension[s] = Kernel<decltype(law)>::tension(g, parameters<decltype(law)>(net_.links, e[s], state.time()));
      }
    });
  }
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::pull_change(const LocalState& state, PetscInt i, PetscInt e, int of, double* pull) const {
  with_law(law_[i], [&](auto law) {
    const LinkGeometry<d> g(state.at(i), state.at(net_.links.other[e]));
    Kernel<decltype(law)>::pull_change(g, parameters<decltype(law)>(net_.links, e, state.time()), of, pull);
  });
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::add_rates(std::vector<double>* rates) const {
  std::vector<double>& sum = *rates;
  for (PetscInt i = 0; i < net_.n; ++i)
    with_law(law_[i], [&](auto law) {
      for (PetscInt e = net_.links.start[i]; e < net_.links.start[i + 1]; ++e)
        sum[i] += Kernel<decltype(law)>::rate(parameters<decltype(law)>(net_.links, e, net_.links.history_time));
    });
  with_law(anchor_law_, [&](auto law) {
    for (std::size_t k = 0; k < net_.anchors.particle.size(); ++k)
      sum[net_.anchors.particle[k]] += Kernel<decltype(law)>::rate(parameters<decltype(law)>(net_.anchors, static_cast<PetscInt>(k), 0));
  });
}

// Of a law: |df/dv| (|v| + |u|), u the velocity of its fluid.
template <int d, class Damper>
void PairForcesOf<d, Damper>::damping_sizes(double t, const LocalState& state, double sigma, double* size) const {
  const AnchorShift shift(motion_, t);
  const Links& links = net_.links;
  const auto speed_of = [&](const double* y) { return norm<d>(y + d) + sigma * norm<d>(y); };
  for (PetscInt i = 0; i < net_.n; ++i) {
    if (net_.fixed[i]) continue;
    const double speed = speed_of(state.at(i));
    for (PetscInt e = links.start[i]; e < links.start[i + 1] && !links.damping.empty(); ++e)
      size[i] += links.damping[e] * (speed + speed_of(state.at(links.other[e])));
    for_anchors(i, state.at(i), shift, [&](auto, PetscInt, const auto&, const auto& p) { size[i] += p.damping * (speed + norm<d>(shift.ds)); });
    for_each_law(laws_, [&](const auto& law) {
      if (!law.active()) return;
      double D[d * d] = {}, most = 0;
      law.template dfdv<d>(point_of(i, t, state), D);
      for (int r = 0; r < d; ++r) most = std::max(most, std::sqrt(d) * norm<d>(D + d * r));
      if constexpr (is_drag<std::decay_t<decltype(law)>> && has_fluid<std::decay_t<decltype(law)>>::value)
        size[i] += most * (speed + norm<d>(law.fluid));
      else size[i] += most * speed;
    });
  }
}

/// Calls use(kernel, i, j, g, p) for every spring at each of its owned ends i; j: the other one.
template <int d, class Damper>
template <class Use>
void PairForcesOf<d, Damper>::for_springs(const LocalState& state, Use&& use) const {
  for (PetscInt i = 0; i < net_.n; ++i)
    for_links(i, state, [&](auto kernel, PetscInt e, const LinkGeometry<d>& g, const auto& p) { use(kernel, i, net_.links.other[e], g, p); });
}

// Every spring is met at both its ends: half from each.
template <int d, class Damper>
void PairForcesOf<d, Damper>::box_forces(const LocalState& state, BoxForces* sum) const {
  for_springs(state, [&](auto kernel, PetscInt, PetscInt j, const LinkGeometry<d>& g, const auto& p) {
    double f[d] = {};
    kernel.force(g, p, f);
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) sum->virial[r * d + c] -= 0.25 * (f[r] * g.dx[c] + f[c] * g.dx[r]);
    if (j < net_.n || net_.image.empty()) return;
    const int* shift = net_.image.data() + static_cast<std::size_t>(j - net_.n) * d;
    for (int k = 0; k < d; ++k)
      for (int c = 0; c < d; ++c) sum->pull[k * d + c] += 0.5 * shift[k] * f[c];
  });
}

template <int d, class Damper>
void PairForcesOf<d, Damper>::particle_stress(const LocalState& state, double* sum) const {
  constexpr int q = d * (d + 1) / 2;
  for_springs(state, [&](auto kernel, PetscInt i, PetscInt, const LinkGeometry<d>& g, const auto& p) {
    double f[d] = {};
    kernel.force(g, p, f);
    for (int r = 0; r < d; ++r)
      for (int c = r; c < d; ++c)
        sum[static_cast<std::size_t>(i) * q + static_cast<std::size_t>(component_place(d, r, c))] -= 0.25 * (f[r] * g.dx[c] + f[c] * g.dx[r]);
  });
}

// Of a spring between i and j, with K = df_i/dx_i and dx = x_i - x_j:
//   d f_i/d e_a = K e_a dx,   d2 E/(d e_a d e_b) = -(e_b dx).(K e_a dx)
template <int d, class Damper>
void PairForcesOf<d, Damper>::strain_response(const LocalState& state, StrainResponse* sum) const {
  constexpr int q = d * (d + 1) / 2;
  double strain[q][d * d];
  for (int a = 0; a < q; ++a) unit_strain(d, a, strain[a]);
  for_springs(state, [&](auto kernel, PetscInt i, PetscInt, const LinkGeometry<d>& g, const auto& p) {
    double K[d * d] = {}, D[d * d] = {}, apart[q][d] = {}, f[q][d] = {};
    kernel.tangent(g, p, K, D);
    for (int a = 0; a < q; ++a) {
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c) apart[a][r] += strain[a][r * d + c] * g.dx[c];
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c) f[a][r] += K[r * d + c] * apart[a][c];
      double* to = sum->force.data() + (static_cast<std::size_t>(a) * static_cast<std::size_t>(net_.n) + static_cast<std::size_t>(i)) * d;
      for (int r = 0; r < d; ++r) {
        to[r] += f[a][r];
        sum->size[static_cast<std::size_t>(a)] += f[a][r] * f[a][r];
      }
    }
    for (int a = 0; a < q; ++a)
      for (int b = 0; b < q; ++b)
        for (int r = 0; r < d; ++r) sum->affine[static_cast<std::size_t>(a * q + b)] -= 0.5 * apart[b][r] * f[a][r];  // half from either end
  });
}

// A bar that turns by an angle a grows by a^2/2 along the straight way. Where it is stiff, that strain exerts forces far above those that turn it,
// and a tangent that takes them for its geometric stiffness T/l (I - u u^T) says next to nothing about the next correction. The tension that Newton's
// linear system asks for, T + T' u.(z_i - z_j), has no such part, and is the tension of the iterate that the next corrections lead to: this is
// Newton's method with the tensions as unknowns of their own, eliminated spring by spring (Magisano, Leonetti, Garcea: Comput. Methods Appl. Mech.
// Engrg. 313, 2017).
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
