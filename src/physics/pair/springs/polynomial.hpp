// Spring that hardens or softens with its stretch: the chains of Fermi, Pasta, Ulam and Tsingou among others.
#pragma once
#include "physics/pair/springs/law.hpp"

namespace bs {

/// Tension T = k s + k2 s^2 + k3 s^3, stretch s = l - L: k [N/m], k2 [N/m^2], k3 [N/m^3], length l [m], rest length L > 0 [m].
struct PolynomialSpring : SpringLawTraits {
  static constexpr const char *name = "polynomial", *title = "k s + k2 s^2 + k3 s^3, s = l - L";
  static constexpr std::array<SpringParameter, 2> parameters{{{"stiffness_2", "k2 of the law polynomial", "N/m^2", {1, -1, -2}, false, false},
                                                              {"stiffness_3", "k3 of the law polynomial", "N/m^3", {1, -2, -2}, false, false}}};
  static constexpr bool zero_rest = false, softens = true;
  static double energy(double l, double k, double L, const double* p) noexcept {
    const double q = l - L;
    return q * q * (k / 2 + q * (p[0] / 3 + q * p[1] / 4));
  }
  /// with q = l - L:  k s^2/2 + k2 (q + s/3) s^2 + k3 (3/2 q^2 + q s + s^2/4) s^2
  static double energy_beyond_slope(double l, double s, double k, double L, const double* p) noexcept {
    const double q = l - L;
    return s * s * (k / 2 + p[0] * (q + s / 3) + p[1] * (q * (1.5 * q + s) + s * s / 4));
  }
  static double tension(double l, double k, double L, const double* p) noexcept {
    const double q = l - L;
    return q * (k + q * (p[0] + q * p[1]));
  }
  static double tension_change(int of, double l, double k, double L, const double* p) noexcept {
    const double q = l - L;
    return of == 0 ? q : of == 1 ? -stiffness(l, k, L, p) : of == 2 ? q * q : q * q * q;
  }
  static double tension_over_length(double l, double k, double L, const double* p) noexcept { return tension(l, k, L, p) / l; }
  static double stiffness(double l, double k, double L, const double* p) noexcept {
    const double q = l - L;
    return k + q * (2 * p[0] + q * 3 * p[1]);
  }
};

}  // namespace bs
