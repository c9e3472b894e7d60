// Spring in series with a dashpot: its tension at constant length decays.
#pragma once
#include <cmath>
#include "physics/pair/springs/law.hpp"

namespace bs {

/// T = k (s - x),  x' = (s - x)/tau,  s = l - L: stiffness k [N/m], length l [m], rest length L > 0 [m], stretch x of the dashpot [m], relaxation
/// time tau > 0 [s] (the dashpot's viscosity is k tau). Through a step from x0, s has the value that it ends with: after the time t of it
///   s - x = (s - x0) exp(-t/tau),   T = k exp(-t/tau) (s - x0),   dT/dl = k exp(-t/tau)
/// which is exact at constant length, and of order 1 else. The dashpot has then taken k/2 (s - x0)^2 (1 - exp(-2 t/tau)). In statics t = 0: the
/// spring answers with k, and x stays.
struct MaxwellSpring : SpringLawTraits {
  static constexpr const char *name = "maxwell", *title = "k (l - L - x), x' = (l - L - x)/tau";
  static constexpr std::array<SpringParameter, 1> parameters{{{"relaxation_time", "tau of the law maxwell", "s", {0, 0, 1}, true, true, true}}};
  /// the dashpot's stretch, and the energy it has taken so far
  static constexpr std::array<SpringHistory, 2> history{{{"viscous_stretch", "m", {0, 1, 0}}, {"viscous_loss", "J", {1, 2, -2}}}};
  // a dashpot that is given shorter than -L makes the rate across larger than the one along
  static constexpr bool zero_rest = false, softens = true, relaxes = true;
  enum { TAU, X, LOSS };

  /// What is left of the tension after the time t. A broken spring has tau = 0.
  static double left(const double* p, double t) noexcept { return t > 0 ? std::exp(-t / p[TAU]) : 1; }
  /// The stored energy.
  static double energy(double l, double k, double L, const double* p, double t) noexcept {
    const double q = (l - L - p[X]) * left(p, t);
    return 0.5 * k * q * q;
  }
  static double energy_beyond_slope(double, double s, double k, double, const double* p, double t) noexcept { return 0.5 * k * left(p, t) * s * s; }
  static double tension(double l, double k, double L, const double* p, double t) noexcept { return k * left(p, t) * (l - L - p[X]); }
  static double tension_change(int of, double l, double k, double L, const double* p, double t) noexcept {
    const double q = l - L - p[X];
    return left(p, t) * (of == 0 ? q : of == 1 ? -k : k * q * t / (p[TAU] * p[TAU]));
  }
  static double tension_over_length(double l, double k, double L, const double* p, double t) noexcept { return tension(l, k, L, p, t) / l; }
  static double stiffness(double, double k, double, const double* p, double t) noexcept { return k * left(p, t); }
  static void commit(double l, double k, double L, double* p, double h) noexcept {
    if (!(h > 0) || !(p[TAU] > 0)) return;
    const double q = l - L - p[X];
    p[X] -= q * std::expm1(-h / p[TAU]);
    p[LOSS] -= 0.5 * k * q * q * std::expm1(-2 * h / p[TAU]);
  }
  static double dissipated(double, const double* p) noexcept { return p[TAU] > 0 ? p[LOSS] : 0; }
};

}  // namespace bs
