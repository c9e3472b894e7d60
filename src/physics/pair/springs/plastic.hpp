// Spring that yields, with linear kinematic hardening (Prager): bilinear, with the Bauschinger effect.
#pragma once
#include <cmath>
#include "physics/pair/springs/law.hpp"

namespace bs {

/// T = k (l - L - e),  |T - H e| <= Y: stiffness k [N/m], length l [m], rest length L > 0 [m], plastic stretch e [m], yield force
/// Y >= 0 [N], hardening H >= 0 [N/m]. From the plastic stretch e0 that the last step ended with,
///   x = k (l - L - e0) - H e0;   |x| <= Y:  e = e0;   else  e = e0 + sign(x) (|x| - Y)/(k + H),  dT/dl = k H/(k + H)
/// T is then the slope of  k/2 (l - L - e)^2 + H/2 e^2 + Y |e - e0|, the least of it over e: what is stored, and what is lost.
struct PlasticSpring : SpringLawTraits {
  static constexpr const char *name = "plastic", *title = "k (l - L - e), |T - H e| <= Y";
  static constexpr std::array<SpringParameter, 2> parameters{{{"yield_force", "Y of the law plastic", "N", {1, 1, -2}, true, true},
                                                              {"hardening", "H of the law plastic, kinematic", "N/m", {1, 0, -2}, true, false}}};
  /// the plastic stretch e and its path, the sum of |de|
  static constexpr std::array<SpringHistory, 2> history{{{"plastic_stretch", "m", {0, 1, 0}}, {"plastic_path", "m", {0, 1, 0}}}};
  static constexpr bool zero_rest = false, softens = true;
  enum { Y, H, E, PATH };

  /// What the plastic stretch would grow by.
  static double flow(double l, double k, double L, const double* p) noexcept {
    const double x = k * (l - L - p[E]) - p[H] * p[E], over = std::abs(x) - p[Y];
    return over > 0 ? std::copysign(over / (k + p[H]), x) : 0;
  }
  /// The stored energy.
  static double energy(double l, double k, double L, const double* p) noexcept {
    const double e = p[E] + flow(l, k, L, p), q = l - L - e;
    return 0.5 * k * q * q + 0.5 * p[H] * e * e;
  }
  /// T rises by k H/(k + H) everywhere, and by k^2/(k + H) more where |x| <= Y, an interval of length 2 Y/k.
  static double energy_beyond_slope(double l, double s, double k, double L, const double* p) noexcept {
    if (!(k > 0)) return 0;
    const double middle = L + p[E] + p[H] * p[E] / k - l, half = p[Y] / k, sum = k + p[H];
    return 0.5 * (k * p[H] / sum) * s * s + ramp_beyond_slope(s, middle - half, middle + half, k * k / sum);
  }
  static double tension(double l, double k, double L, const double* p) noexcept { return k * (l - L - p[E] - flow(l, k, L, p)); }
  /// Where it yields, with e0 + de = e:  d(de)/dk = (l - L - e)/(k + H),  d(de)/dY = -sign(x)/(k + H),  d(de)/dH = -e/(k + H)
  static double tension_change(int of, double l, double k, double L, const double* p) noexcept {
    const double grown = flow(l, k, L, p), e = p[E] + grown, q = l - L - e;
    const bool yields = stiffness(l, k, L, p) != k;
    if (of == 1) return -stiffness(l, k, L, p);
    if (!yields) return of == 0 ? q : 0;
    return (of == 0 ? q * p[H] : of == 2 + Y ? std::copysign(k, grown) : k * e) / (k + p[H]);
  }
  static double tension_over_length(double l, double k, double L, const double* p) noexcept { return tension(l, k, L, p) / l; }
  /// Where a step that yielded ended, |x| = Y to rounding and T has two slopes: it is the elastic one, whatever the rounding.
  static double stiffness(double l, double k, double L, const double* p) noexcept {
    const double x = std::abs(k * (l - L - p[E]) - p[H] * p[E]);
    return x - p[Y] > 1e-10 * (x + p[Y]) ? k * p[H] / (k + p[H]) : k;
  }
  static void commit(double l, double k, double L, double* p) noexcept {
    const double grown = flow(l, k, L, p);
    p[E] += grown;
    p[PATH] += std::abs(grown);
  }
  static double dissipated(double, const double* p) noexcept { return p[Y] * p[PATH]; }
};

}  // namespace bs
