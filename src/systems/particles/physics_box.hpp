// Stress in a periodic box; included by physics_impl.hpp alone.
#pragma once
#include "systems/particles/physics_impl.hpp"

namespace bs {

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

}  // namespace bs
