// Cable: pulls when longer than its rest length, slack when shorter.
#pragma once
#include <limits>
#include "physics/pair/springs/law.hpp"

namespace bs {

/// Tension T = k (l - L) for l >= L, else 0: k [N/m], length l [m], rest length L > 0 [m].
struct TensionSpring : SpringLawTraits {
  static constexpr const char *name = "tension", *title = "k max(l - L, 0)";
  static double energy(double l, double k, double L) noexcept { return l < L ? 0 : 0.5 * k * (l - L) * (l - L); }
  static double energy_beyond_slope(double l, double s, double k, double L) noexcept {
    return ramp_beyond_slope(s, L - l, std::numeric_limits<double>::infinity(), k);
  }
  static double tension(double l, double k, double L) noexcept { return l < L ? 0 : k * (l - L); }
  static double tension_change(int of, double l, double k, double L) noexcept { return l < L ? 0 : of == 0 ? l - L : -k; }
  static double tension_over_length(double l, double k, double L) noexcept { return tension(l, k, L) / l; }
  static double stiffness(double l, double k, double L) noexcept { return l < L ? 0 : k; }
};

}  // namespace bs
