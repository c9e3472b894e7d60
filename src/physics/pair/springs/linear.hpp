// Linear springs: stiffness as force per length, as force per strain, and without a rest length.
#pragma once
#include "physics/pair/springs/law.hpp"

namespace bs {

/// Tension T = k (l - L): k [N/m], length l [m], rest length L > 0 [m].
struct HookeSpring : SpringLawTraits {
  static constexpr const char *name = "hooke", *title = "k (l - L)";
  static double energy(double l, double k, double L) noexcept { return 0.5 * k * (l - L) * (l - L); }
  /// e(l + s) - e(l) - T(l) s for a change of length s.
  static double energy_beyond_slope(double, double s, double k, double) noexcept { return 0.5 * k * s * s; }
  static double tension(double l, double k, double L) noexcept { return k * (l - L); }
  static double tension_change(int of, double l, double k, double L) noexcept { return of == 0 ? l - L : -k; }
  /// Real: a number, or a register of them.
  template <class Real>
  static Real tension_over_length(Real l, Real k, Real L) noexcept {
    return k * (l - L) / l;
  }
  template <class Real>
  static Real stiffness(Real, Real k, Real) noexcept {
    return k;
  }
};

/// Stiffness as force per strain, a property of the material and the cross-section: tension T = K (l/L - 1), K [N], length l [m], rest length L > 0
/// [m]; the rate is K/L.
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

/// Linear in the vector between its ends, so regular where they meet: tension T = K l, K [N/m], length l [m]; the rest length is not used.
struct ZeroRestSpring : SpringLawTraits {
  static constexpr const char* title = "zero rest length";
  static constexpr bool regular_at_zero = true;
  static double energy(double l, double K, double) noexcept { return 0.5 * K * l * l; }
  static double tension(double l, double K, double) noexcept { return K * l; }
  static double tension_change(int of, double l, double, double) noexcept { return of == 0 ? l : 0; }
  static double tension_over_length(double, double K, double) noexcept { return K; }
  static double stiffness(double, double K, double) noexcept { return K; }
};

}  // namespace bs
