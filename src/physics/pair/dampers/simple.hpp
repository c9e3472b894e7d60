// Damper of the whole relative velocity of its two ends; it damps rotation, too.
#pragma once
#include "physics/vector.hpp"

namespace bs {

/// f_i = -D w,  w = v_i - v_j [d], D [kg/s]; dx and l as for AxialDamper, not used. All functions ADD.
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
