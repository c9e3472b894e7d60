// Linear spring, stiffness as force per strain (a property of the material and the cross-section).
#pragma once
#include "physics/pair/springs/law.hpp"

namespace bs {

/// Tension T = K (l/L - 1): K [N], length l [m], rest length L > 0 [m]; the rate is K/L.
struct StrainSpring : SpringLawTraits {
  static constexpr const char *name = "strain", *title = "K (l/L - 1)";
  static double energy(double l, double K, double L) noexcept { return 0.5 * K / L * (l - L) * (l - L); }
  /// e(l + s) - e(l) - T(l) s for a change of length s.
  static double energy_beyond_slope(double, double s, double K, double L) noexcept { return 0.5 * K / L * s * s; }
  static double tension(double l, double K, double L) noexcept { return K * (l - L) / L; }
  static double tension_change(int of, double l, double K, double L) noexcept { return of == 0 ? (l - L) / L : -K * l / (L * L); }
  /// Real: a number, or a register of them.
  template <class Real>
  static Real tension_over_length(Real l, Real K, Real L) noexcept {
    return K * (l - L) / (L * l);
  }
  template <class Real>
  static Real stiffness(Real, Real K, Real L) noexcept {
    return K / L;
  }
};

}  // namespace bs
