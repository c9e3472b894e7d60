// Attraction to a centre, "frce 2" of .xsp scenes.
#pragma once
#include <cmath>
#include <string>

#include "physics/body/law_options.hpp"
#include "physics/body/point.hpp"
#include "physics/body/xsp_power_law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// With r = C - x, l = radius + 1 (the attracted particle's radius, from its mass):
///   |r| >= l:  f = m value/|r|^p r/|r|
///   |r| <  l:  f = m value/l^p (|r|/l)^2 r/|r|,  0 at r = 0
struct XspAttraction {
  static constexpr const char* title = "attraction to a centre";
  static constexpr Potential potential = Potential::of_position;
  double value = 0;              ///< acceleration at distance 1 [m^(1+p)/s^2]; < 0 repels; off: 0
  double exponent = 0;           ///< p [1]
  double center[3] = {0, 0, 0};  ///< C [m]
  int components = 2;            ///< how many of `center` were given

  template <class V>
  void options(V& o) {
    const bool on = o.real("-bs_xsp_attraction",
                           "attraction of XSpringies: acceleration value/r^p toward the centre at distances r beyond the radius + 1, value "
                           "(r/l)^2/l^p inside, l = radius + 1; a negative value repels, 0: none [pixel/s^2]",
                           value);
    const bool power = o.real("-bs_xsp_attraction_exponent", "attraction of XSpringies: exponent p [1]", exponent);
    // read by -bs_xsp_center_of_mass, too, so it may stand without an attraction
    read_vector(o, "-bs_xsp_attraction_center", "centre x,y[,z] of -bs_xsp_attraction and -bs_xsp_center_of_mass [pixel]", center, components);
    if (power) require(o, on, "-bs_xsp_attraction_exponent", "-bs_xsp_attraction");
  }
  bool active() const noexcept { return value != 0; }
  std::string describe() const {
    return "attraction " + short_number(value) + "/r^" + short_number(exponent) + " to " + vector_text(center, components);
  }

  /// The work done against the force from |r| = l on: 0 there.
  template <int d>
  double energy(const Point<d>& p) const noexcept {
    double r[d];
    for (int i = 0; i < d; ++i) r[i] = center[i] - p.x[i];
    const double s = norm<d>(r), l = xsp_radius(p.m) + 1;
    if (s >= l) return p.m * value * power_integral(l, s, exponent);
    return p.m * value * std::pow(l, 1 - exponent) * ((s / l) * (s / l) * (s / l) - 1) / 3;
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    attraction_force<d>(p.m, value, exponent, p.x, center, f);
    return true;
  }
  template <int d>
  void dfdx(const Point<d>& p, double* K) const noexcept {
    attraction_dfdx<d>(p.m, value, exponent, p.x, center, K);
  }
  template <int d>
  void dfdv(const Point<d>&, double*) const noexcept {}

  /// ADDS the force on a particle of mass m at x toward C; for centres that move, too.
  template <int d>
  static void attraction_force(double m, double value, double exponent, const double* x, const double* C, double* f) noexcept {
    double r[d];
    for (int i = 0; i < d; ++i) r[i] = C[i] - x[i];
    const double s = norm<d>(r), l = xsp_radius(m) + 1;
    const double q = m * value * (s >= l ? std::pow(s, -exponent) / s : std::pow(l, -exponent) * s / (l * l));
    for (int i = 0; i < d; ++i) f[i] += q * r[i];
  }
  /// ADDS df/dx (df/dC is its negative); with n = r/|r|:
  ///   |r| >= l:  -m value/|r|^(p+1) (I - (p+1) n n^T);   |r| < l:  -m value/l^(p+2) |r| (I + n n^T)
  /// At |r| = l, where the slope jumps, it is the outer one.
  template <int d>
  static void attraction_dfdx(double m, double value, double exponent, const double* x, const double* C, double* K) noexcept {
    double n[d];
    for (int i = 0; i < d; ++i) n[i] = C[i] - x[i];
    const double s = norm<d>(n), l = xsp_radius(m) + 1;
    if (!(s > 0)) return;
    for (int i = 0; i < d; ++i) n[i] /= s;
    const double q = m * value * (s >= l ? std::pow(s, -exponent) / s : std::pow(l, -exponent) * s / (l * l));
    add_tensor<d>(-q, s >= l ? (exponent + 1) * q : -q, n, K);
  }
};

}  // namespace bs
