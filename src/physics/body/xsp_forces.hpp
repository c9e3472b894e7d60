// The two power laws of .xsp scenes. Their constants (radius, gap 1) are in the scenes' units: pixels and a mass of 1, which stand in place of m and
// kg.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include "lattice/xsp.hpp"
#include "physics/body/law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// Integral of s^-p from a to b (a, b > 0): (b^(1-p) - a^(1-p))/(1-p), which is ln(b/a) at p = 1.
inline double power_integral(double a, double b, double p) noexcept {
  const double q = 1 - p, log_ratio = std::log(b / a);
  return std::pow(a, q) * (q == 0 ? log_ratio : std::expm1(q * log_ratio) / q);
}

/// Attraction to a centre, "frce 2" of .xsp scenes. With r = C - x, l = radius + 1 (the attracted particle's radius, from its mass):
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
    const bool on = o.real(
        "-bs_xsp_attraction",
        "attraction of XSpringies: acceleration value/r^p toward the centre at distances r beyond l, value (r/l)^2/l^p inside, l = 1 + the radius "
        "that XSpringies gives a mass, max(1, min(64, trunc(2 ln(4 m + 1)))); a negative value repels, 0: none [pixel/s^2]",
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

  template <int d>
  double energy(const Point<d>& p) const noexcept {
    return attraction_energy<d>(p.m, value, exponent, p.x, center);
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

  /// Of a particle of mass m at x: the work done against the force from |r| = l on, 0 there. Like the two below for centres that move, too.
  template <int d>
  static double attraction_energy(double m, double value, double exponent, const double* x, const double* C) noexcept {
    double r[d];
    for (int i = 0; i < d; ++i) r[i] = C[i] - x[i];
    const double s = norm<d>(r), l = xsp_radius(m) + 1;
    if (s >= l) return m * value * power_integral(l, s, exponent);
    return m * value * std::pow(l, 1 - exponent) * ((s / l) * (s / l) * (s / l) - 1) / 3;
  }
  /// ADDS the force on it toward C.
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

/// Walls that repel, "frce 3" of .xsp scenes. From each wall that is there, away from it:  f = m value/max(1, gap)^p where gap >= 0, else
/// 0; gap = distance of the particle's centre from the wall, less its radius (from its mass). d = 1 has no top and bottom; the third axis of d = 3
/// has no walls.
struct XspWalls {
  static constexpr const char* title = "repelling walls";
  static constexpr Potential potential = Potential::of_position;
  double value = 0;                              ///< acceleration at gap 1 [m^(1+p)/s^2]; < 0 attracts; off: 0
  double exponent = 0;                           ///< p [1]
  double box[4] = {0, 642, 0, 550};              ///< xmin, xmax, ymin, ymax [m]; the default is the window of .xsp scenes
  bool sides[4] = {false, false, false, false};  ///< is there a wall: top, left, right, bottom

  template <class V>
  void options(V& o) {
    o.real("-bs_xsp_walls",
           "walls of XSpringies: acceleration value/max(1, gap)^p away from each wall, with the gap measured from the particle's rim (its radius is "
           "that of -bs_xsp_attraction), 0 behind the wall; a negative value attracts, 0: none [pixel/s^2]",
           value);
    o.real("-bs_xsp_walls_exponent", "walls of XSpringies: exponent p [1]", exponent);
    int count = 4;
    o.reals("-bs_xsp_walls_box", "walls of XSpringies: positions xmin,xmax,ymin,ymax, each min < max [pixel]", box, 4, &count);
    if (count != 4 || !(box[0] < box[1]) || !(box[2] < box[3]))
      o.fail("option -bs_xsp_walls_box: needs xmin < xmax and ymin < ymax: give four numbers xmin,xmax,ymin,ymax [m]");
    double given[4] = {double(sides[0]), double(sides[1]), double(sides[2]), double(sides[3])};
    count = 4;
    o.reals("-bs_xsp_walls_sides", "walls of XSpringies: four numbers top,left,right,bottom, 1 for a wall on that side, 0 for none", given, 4,
            &count);
    for (int i = 0; i < 4; ++i) {
      if (count != 4 || (given[i] != 0 && given[i] != 1))
        o.fail("option -bs_xsp_walls_sides: needs four numbers, each 0 or 1: give top,left,right,bottom, e.g. 1,1,1,1");
      sides[i] = given[i] != 0;
    }
  }
  bool active() const noexcept { return value != 0 && (sides[0] || sides[1] || sides[2] || sides[3]); }
  std::string describe() const {
    constexpr const char* names[] = {"top", "left", "right", "bottom"};
    std::string text = "walls repel with " + short_number(value) + "/max(1, gap)^" + short_number(exponent) + " per mass:";
    for (int i = 0; i < 4; ++i)
      if (sides[i]) text += std::string(" ") + names[i];
    return text;
  }

  /// Continuous, 0 at gap 1 of a wall; constant behind it (the force jumps to 0 there).
  template <int d>
  double energy(const Point<d>& p) const noexcept {
    double sum = 0;
    each_wall<d>(p, [&](int, double, double gap) {
      const double s = std::max(1.0, gap);
      sum += (1 - std::max(0.0, std::min(1.0, gap))) - power_integral(1, s, exponent);
    });
    return p.m * value * sum;
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    each_wall<d>(p, [&](int axis, double away, double gap) {
      if (gap >= 0) f[axis] += away * p.m * value * std::pow(std::max(1.0, gap), -exponent);
    });
    return true;
  }
  /// df/dx = -m value p/gap^(p+1) where gap > 1, whichever way the wall looks; else 0
  template <int d>
  void dfdx(const Point<d>& p, double* K) const noexcept {
    each_wall<d>(p, [&](int axis, double, double gap) {
      if (gap > 1) K[d * axis + axis] -= p.m * value * exponent * std::pow(gap, -exponent - 1);
    });
  }
  template <int d>
  void dfdv(const Point<d>&, double*) const noexcept {}

 private:
  /// Calls wall(axis, direction away from the wall, gap) for each wall that is there.
  template <int d, class Wall>
  void each_wall(const Point<d>& p, Wall&& wall) const noexcept {
    const double radius = xsp_radius(p.m);
    if (sides[1]) wall(0, 1.0, p.x[0] - box[0] - radius);
    if (sides[2]) wall(0, -1.0, box[1] - radius - p.x[0]);
    if constexpr (d > 1) {
      if (sides[0]) wall(1, -1.0, box[3] - radius - p.x[1]);
      if (sides[3]) wall(1, 1.0, p.x[1] - box[2] - radius);
    }
  }
};

}  // namespace bs
