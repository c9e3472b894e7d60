// Links of a particle that are springs alone, without dampers or zero rest lengths: lengths and tensions of many at once, in
// loops that vectorise, then their sum in the links' order, which is the same on any number of ranks.
#pragma once
#include <algorithm>
#include <cmath>
#include "linalg/lanes.hpp"
#include "network/network.hpp"
#include "systems/layout.hpp"

namespace bs {

/// Length of a link of stiffness K from its square. One without stiffness exerts nothing, also where its ends meet: any length will do.
inline double plain_length(double square, double K) noexcept { return std::sqrt(K != 0 ? square : 1.0); }

/// Calls measure(k, link, square, dx) for k < count of each run of links, then add(k) in order. dx_c = y_c - other end's.
template <int d, class Measure, class Add>
inline void for_plain_links(const Links& links, PetscInt i, const double* y, const double* states, Measure&& measure, Add&& add) {
  constexpr PetscInt CHUNK = 32;
  const PetscInt end = links.start[i + 1];
  const PetscInt* other = links.other.data();
  for (PetscInt begin = links.start[i]; begin < end; begin += CHUNK) {
    const PetscInt count = std::min(CHUNK, end - begin);
    for (PetscInt k = 0; k < count; ++k) {
      const double* end_state = Layout{d}.of(states, other[begin + k]);
      double dx[d], square = 0;
      for (int c = 0; c < d; ++c) {
        dx[c] = y[c] - end_state[c];
        square += dx[c] * dx[c];
      }
      measure(k, begin + k, square, dx);
    }
    for (PetscInt k = 0; k < count; ++k) add(k);
  }
}

/// Adds the first `count` of four links, link(k) their places, with stiffnesses K and rest lengths L, to the sums of sum_plain_links_3d. dx is
/// subtracted from the particle's place `here`; four rows of it are turned into columns for the lengths.
template <class Spring, bool with_energy, class Link>
inline void add_four(const PetscInt* other, Link&& link, int count, lanes::Vector<3> K, lanes::Vector<3> L, lanes::Vector<3> here,
                     const double* states, lanes::Vector<3>* sum, double* energy) {
  using Four = lanes::Vector<3>;
  Four dx[4], l;
  for (int k = 0; k < 4; ++k) dx[k] = here - lanes::load<3>(Layout{3}.of(states, other[link(k)]));
  const Four a = __builtin_shufflevector(dx[0], dx[1], 0, 4, 2, 6), b = __builtin_shufflevector(dx[2], dx[3], 0, 4, 2, 6);
  const Four c = __builtin_shufflevector(dx[0], dx[1], 1, 5, 3, 7), e = __builtin_shufflevector(dx[2], dx[3], 1, 5, 3, 7);
  const Four x = __builtin_shufflevector(a, b, 0, 1, 4, 5), y = __builtin_shufflevector(c, e, 0, 1, 4, 5),
             z = __builtin_shufflevector(a, b, 2, 3, 6, 7);
  const Four square = x * x + y * y + z * z;
  for (int k = 0; k < 4; ++k) l[k] = plain_length(square[k], K[k]);
  const Four q = Spring::tension_over_length(l, K, L), twice = q * l * (l - L);
  for (int k = 0; k < count; ++k) {
    *sum -= q[k] * dx[k];
    if (with_energy) *energy += twice[k];
  }
}

/// -sum (T/l) dx over the links of owned particle i. One copy, so that it has the same bits wherever it is called.
template <int d, class Spring>
__attribute__((noinline)) void sum_plain_links(const Links& links, PetscInt i, const double* y, const double* states, double* sum) {
  double q[32], x[d][32];
  for_plain_links<d>(
      links, i, y, states,
      [&](PetscInt k, PetscInt e, double square, const double* dx) {
        for (int c = 0; c < d; ++c) x[c][k] = dx[c];
        q[k] = Spring::tension_over_length(plain_length(square, links.stiffness[e]), links.stiffness[e], links.rest_length[e]);
      },
      [&](PetscInt k) {
        for (int c = 0; c < d; ++c) sum[c] -= q[k] * x[c][k];
      });
}

/// Twice the energy of the links of owned particle i [J]: T (l - L) each, for both laws that are compiled here are linear.
template <int d, class Spring>
inline double twice_plain_energy(const Links& links, PetscInt i, const double* y, const double* states) {
  double part[32], sum = 0;
  for_plain_links<d>(
      links, i, y, states,
      [&](PetscInt k, PetscInt e, double square, const double*) {
        const double K = links.stiffness[e], l = plain_length(square, K), L = links.rest_length[e];
        part[k] = Spring::tension_over_length(l, K, L) * l * (l - L);
      },
      [&](PetscInt k) { sum += part[k]; });
  return sum;
}

/// Both in one, with_energy: in three dimensions a state, with one number more, fills a register: no gathering. Of the last links that are not four,
/// the lanes without one take the last link again, and are not summed.
template <class Spring, bool with_energy>
inline void sum_plain_links_3d(const Links& links, PetscInt i, const double* y, const double* states, double* sum, double* energy) {
  const PetscInt end = links.start[i + 1];
  const lanes::Vector<3> here = lanes::load<3>(y);
  lanes::Vector<3> whole = {0, 0, 0, 0};
  const PetscInt* other = links.other.data();
  const double *stiffness = links.stiffness.data(), *rest_length = links.rest_length.data();
  PetscInt e = links.start[i];
  for (; e + 4 <= end; e += 4)
    add_four<Spring, with_energy>(
        other, [e](int k) { return e + k; }, 4, lanes::load<3>(stiffness + e), lanes::load<3>(rest_length + e), here, states, &whole, energy);
  if (e < end) {
    const auto link = [e, end](int k) { return std::min(e + k, end - 1); };
    lanes::Vector<3> K, L;
    for (int k = 0; k < 4; ++k) K[k] = stiffness[link(k)], L[k] = rest_length[link(k)];
    add_four<Spring, with_energy>(other, link, static_cast<int>(end - e), K, L, here, states, &whole, energy);
  }
  for (int c = 0; c < 3; ++c) sum[c] = whole[c];
}

/// f += -sum (T/l) dx over the links of owned particle i at y; `states`: (x, v) of all local particles. False, and f
/// untouched, where that is not finite. with_energy: `energy` receives that of the links [J] in any case.
template <int d, class Spring, bool with_energy = false>
inline bool add_plain_links(const Links& links, PetscInt i, const double* y, const double* states, double* f, double* energy = nullptr) {
  double sum[d] = {}, twice = 0, size = 0;
  if constexpr (d == 3) {
    sum_plain_links_3d<Spring, with_energy>(links, i, y, states, sum, &twice);
  } else {
    sum_plain_links<d, Spring>(links, i, y, states, sum);
    if (with_energy) twice = twice_plain_energy<d, Spring>(links, i, y, states);
  }
  if (with_energy) *energy = 0.5 * twice;
  for (int c = 0; c < d; ++c) size += std::abs(sum[c]);
  if (!std::isfinite(size)) return false;
  for (int c = 0; c < d; ++c) f[c] += sum[c];
  return true;
}

/// What the energy of the links of owned particle i changes by beyond its slope when local states move by lambda `lines` [J];
/// the formulas are those of spring_energy_beyond_slope.
template <int d, class Spring>
inline double plain_beyond_slope(const Links& links, PetscInt i, const double* y, const double* states, const double* lines, double lambda) {
  const double *stiffness = links.stiffness.data(), *rest_length = links.rest_length.data();
  const double* z = Layout{d}.of(lines, i);
  double part[32], sum = 0;
  for_plain_links<d>(
      links, i, y, states,
      [&](PetscInt k, PetscInt e, double before, const double* dx) {
        const double* end_line = Layout{d}.of(lines, links.other[e]);
        double square = 0, along = 0, after = 0;
        for (int c = 0; c < d; ++c) {
          const double dd = lambda * (z[c] - end_line[c]), there = dx[c] + dd;
          square += dd * dd;
          along += dx[c] * dd;
          after += there * there;
        }
        const double l = plain_length(before, stiffness[e]), whole = l + std::sqrt(after), s = (2 * along + square) / whole;
        part[k] = Spring::energy_beyond_slope(l, s, stiffness[e], rest_length[e]) +
                  Spring::tension(l, stiffness[e], rest_length[e]) * (square - s * along / l) / whole;
      },
      [&](PetscInt k) { sum += part[k]; });
  return sum;
}

}  // namespace bs
