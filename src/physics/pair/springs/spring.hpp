// Force and tangent of a spring between particles i and j, for any law of central force. A Law gives the energy, the
// tension T(l), T/l and T'(l) (law.hpp). Throughout dx = x_i - x_j [d], l = |dx| > 0 [m], u = dx/l, and every function ADDS.
// l = 0 is allowed where Law::regular_at_zero; elsewhere the caller sees to it. `more`: what the law takes beyond k and L.
#pragma once
#include <algorithm>
#include <cmath>
#include "physics/pair/springs/linear.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f_i += -T u = -(T/l) dx; the force on j is the negative.
template <int d, class Law, class... More>
inline void spring_force(const double* dx, double l, double k, double L, double* f, const More&... more) noexcept {
  const double q = Law::tension_over_length(l, k, L, more...);
  for (int i = 0; i < d; ++i) f[i] -= q * dx[i];
}

/// e(x + dd) - e(x) - e'(x).dd = e(l + s) - e(l) - T s + T (s - u.dd), where the change of length s and
/// s - u.dd = (|dd|^2 - s u.dd)/(2l + s) are free of cancellation. A law of zero rest length is linear in dx: K/2 |dd|^2.
template <int d, class Law, class... More>
inline double spring_energy_beyond_slope(const double* dx, double l, const double* dd, double k, double L, const More&... more) noexcept {
  const double square = dot<d>(dd, dd);
  if constexpr (Law::regular_at_zero) {
    return 0.5 * k * square;
  } else {
    double after[d];
    for (int i = 0; i < d; ++i) after[i] = dx[i] + dd[i];
    const double sum = l + norm<d>(after), along = dot<d>(dx, dd) / l, s = (2 * l * along + square) / sum;
    return Law::energy_beyond_slope(l, s, k, L, more...) + Law::tension(l, k, L, more...) * (square - s * along) / sum;
  }
}

/// The two rates of a spring [N/m]: along it T', across it T/l.
struct SpringTangent {
  double axial, transverse;
};

/// `positive`: a negative transverse rate (compressed spring, l < L) becomes 0, so that -df/dx is positive
/// semidefinite; so does a negative axial rate of a law that softens.
template <class Law, bool positive = false, class... More>
inline SpringTangent spring_tangent(double l, double k, double L, const More&... more) noexcept {
  const double q = Law::tension_over_length(l, k, L, more...);
  double axial = Law::stiffness(l, k, L, more...);
  if constexpr (positive && Law::softens) axial = std::max(axial, 0.0);
  return {axial, positive && q < 0 ? 0 : q};
}

/// Force per length along the spring, for estimates [N/m]: at its rest length, or the largest there and at strains of 10 % where
/// the rate varies.
template <class Law, class... More>
inline double spring_rate(double k, double L, const More&... more) noexcept {
  if (L == 0) return k;
  double rate = Law::stiffness(L, k, L, more...);
  if constexpr (Law::softens)
    for (const double l : {0.9 * L, L, 1.1 * L}) rate = std::max(rate, std::abs(Law::stiffness(l, k, L, more...)));
  return rate;
}

/// B += df_i/dx_i = -(T' u u^T + (T/l)(I - u u^T)), d x d row-major; df_i/dx_j = -B.
template <int d, class Law, bool positive = false, class... More>
inline void spring_dfdx(const double* dx, double l, double k, double L, double* B, const More&... more) noexcept {
  const SpringTangent rate = spring_tangent<Law, positive>(l, k, L, more...);
  // The direction drops out where both rates are one by the law; dividing by l = 0 must be kept out.
  if constexpr (!Law::regular_at_zero) {
    double u[d];
    for (int i = 0; i < d; ++i) u[i] = dx[i] / l;
    add_tensor<d>(-rate.transverse, rate.transverse - rate.axial, u, B);
  } else {
    for (int i = 0; i < d; ++i) B[d * i + i] -= rate.transverse;
  }
}

}  // namespace bs
