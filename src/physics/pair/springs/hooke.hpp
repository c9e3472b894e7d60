// Linear spring, stiffness as force per length.
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

}  // namespace bs
