// Links of a particle that are springs alone, without dampers or zero rest lengths: lengths and tensions of many at once, in
// loops that vectorise, then their sum in the links' order, which is the same on any number of ranks.
#pragma once
#include <algorithm>
#include <cmath>
#include "network/network.hpp"

namespace bs {

/// Calls measure(k, link, square, dx) for k < count of each run of links, then add(k) in order. dx_c = y_c - other end's.
template <int d, class Measure, class Add>
inline void for_plain_links(const Links& links, PetscInt i, const double* y, const double* states, Measure&& measure, Add&& add) {
  constexpr PetscInt CHUNK = 32;
  const PetscInt end = links.start[i + 1];
  const PetscInt* other = links.other.data();
  for (PetscInt begin = links.start[i]; begin < end; begin += CHUNK) {
    const PetscInt count = std::min(CHUNK, end - begin);
    for (PetscInt k = 0; k < count; ++k) {
      const double* end_state = states + static_cast<std::size_t>(other[begin + k]) * 2 * d;
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

/// f += -sum (T/l) dx over the links of owned particle i at y; `states`: (x, v) of all local particles. False, and f
/// untouched, where that is not finite. with_energy: `energy` receives that of the links [J] in any case.
template <int d, class Spring, bool with_energy = false>
inline bool add_plain_links(const Links& links, PetscInt i, const double* y, const double* states, double* f, double* energy = nullptr) {
  const double *stiffness = links.stiffness.data(), *rest_length = links.rest_length.data();
  double q[32], x[d][32], part[32], sum[d] = {}, whole = 0;
  for_plain_links<d>(
      links, i, y, states,
      [&](PetscInt k, PetscInt e, double square, const double* dx) {
        for (int c = 0; c < d; ++c) x[c][k] = dx[c];
        const double l = std::sqrt(square);
        q[k] = Spring::tension_over_length(l, stiffness[e], rest_length[e]);
        if (with_energy) part[k] = q[k] * l * (l - rest_length[e]);
      },
      [&](PetscInt k) {
        if (with_energy) whole += part[k];
        for (int c = 0; c < d; ++c) sum[c] -= q[k] * x[c][k];
      });
  if (with_energy) *energy = 0.5 * whole;
  double size = 0;
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
  const double* z = lines + static_cast<std::size_t>(i) * 2 * d;
  double part[32], sum = 0;
  for_plain_links<d>(
      links, i, y, states,
      [&](PetscInt k, PetscInt e, double before, const double* dx) {
        const double* end_line = lines + static_cast<std::size_t>(links.other[e]) * 2 * d;
        double square = 0, along = 0, after = 0;
        for (int c = 0; c < d; ++c) {
          const double dd = lambda * (z[c] - end_line[c]), there = dx[c] + dd;
          square += dd * dd;
          along += dx[c] * dd;
          after += there * there;
        }
        const double l = std::sqrt(before), whole = l + std::sqrt(after), s = (2 * along + square) / whole;
        part[k] = Spring::energy_beyond_slope(l, s, stiffness[e], rest_length[e]) +
                  Spring::tension(l, stiffness[e], rest_length[e]) * (square - s * along / l) / whole;
      },
      [&](PetscInt k) { sum += part[k]; });
  return sum;
}

/// Energy of the links of owned particle i [J]: T (l - L)/2 each, for both laws that are compiled here are linear.
template <int d, class Spring>
inline double plain_energy(const Links& links, PetscInt i, const double* y, const double* states) {
  const double *stiffness = links.stiffness.data(), *rest_length = links.rest_length.data();
  double part[32], sum = 0;
  for_plain_links<d>(
      links, i, y, states,
      [&](PetscInt k, PetscInt e, double square, const double*) {
        const double l = std::sqrt(square);
        part[k] = Spring::tension_over_length(l, stiffness[e], rest_length[e]) * l * (l - rest_length[e]);
      },
      [&](PetscInt k) { sum += part[k]; });
  return 0.5 * sum;
}

}  // namespace bs
