// Dampers between two ends.
#pragma once
#include "physics/vector.hpp"

namespace bs {

/// Along the line of its two ends: f_i = -D (u.w) u,  u = dx/l,  dx = x_i - x_j [d], w = v_i - v_j [d], l = |dx| > 0 (the caller sees to it), D
/// [kg/s]. The force on j and both derivatives by its state are the negatives. All functions ADD.
struct AxialDamper {
  static constexpr const char *name = "axial", *title = "D (u.w) u";
  static constexpr bool regular_at_zero = false;  ///< no direction at l = 0

  /// With the direction u held at the state searched from, R = D/2 (u.w)^2, whose slope there is the law's own force:
  ///   R(w + dw) - R(w) - R'(w).dw = D/2 (u.dw)^2
  /// The direction is renewed with every Newton iterate, so at convergence nothing is approximated.
  template <int d>
  static double dissipation_beyond_slope(const double* dx, double l, const double* dw, double D) noexcept {
    const double along = dot<d>(dx, dw) / l;
    return 0.5 * D * along * along;
  }
  template <int d>
  static void force(const double* dx, double l, const double* w, double D, double* f) noexcept {
    const double q = D * (dot<d>(dx, w) / l) / l;
    for (int i = 0; i < d; ++i) f[i] -= q * dx[i];
  }
  /// df_i/dx_i = -D/l [(u.w) P + u (P w)^T],  P = I - u u^T; not symmetric
  template <int d>
  static void dfdx(const double* dx, double l, const double* w, double D, double* K) noexcept {
    double u[d];
    for (int i = 0; i < d; ++i) u[i] = dx[i] / l;
    const double uw = dot<d>(u, w), q = D / l;
    for (int i = 0; i < d; ++i) {
      for (int j = 0; j < d; ++j) K[d * i + j] -= q * u[i] * (w[j] - 2 * uw * u[j]);
      K[d * i + i] -= q * uw;
    }
  }
  /// df_i/dv_i = -D u u^T
  template <int d>
  static void dfdv(const double* dx, double l, double D, double* B) noexcept {
    double u[d];
    for (int i = 0; i < d; ++i) u[i] = dx[i] / l;
    add_tensor<d>(0, -D, u, B);
  }
  /// Adds to the rates of -(b df/dv + c df/dx) along and across the line: b D u u^T + c D (u.w) P / l; the rest of df/dx has
  /// neither form.
  template <int d, bool positive, class Rates>
  static void add_rates(const double* dx, double l, const double* w, double D, double b, double c, Rates* rate) noexcept {
    rate->axial += b * D;
    if constexpr (!positive) rate->transverse += c * D * (dot<d>(dx, w) / l) / l;
  }
};

/// Of the whole relative velocity of its two ends; it damps rotation, too: f_i = -D w,  w = v_i - v_j [d], D [kg/s]; dx and l as for AxialDamper, not
/// used. All functions ADD.
struct SimpleDamper {
  static constexpr const char *name = "simple", *title = "D w";
  static constexpr bool regular_at_zero = true;

  /// R = D/2 |w|^2:  R(w + dw) - R(w) - R'(w).dw = D/2 |dw|^2
  template <int d>
  static double dissipation_beyond_slope(const double*, double, const double* dw, double D) noexcept {
    return 0.5 * D * dot<d>(dw, dw);
  }
  template <int d>
  static void force(const double*, double, const double* w, double D, double* f) noexcept {
    for (int i = 0; i < d; ++i) f[i] -= D * w[i];
  }
  template <int d>
  static void dfdx(const double*, double, const double*, double, double*) noexcept {}
  /// df_i/dv_i = -D I
  template <int d>
  static void dfdv(const double*, double, double D, double* B) noexcept {
    for (int i = 0; i < d; ++i) B[d * i + i] -= D;
  }
  /// Adds to the rates of -b df/dv along and across the line: b D I.
  template <int d, bool positive, class Rates>
  static void add_rates(const double*, double, const double*, double D, double b, double, Rates* rate) noexcept {
    rate->axial += b * D;
    rate->transverse += b * D;
  }
};

}  // namespace bs
