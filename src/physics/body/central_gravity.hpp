// Gravity of a point mass that does not move.
#pragma once
#include <cmath>
#include <string>

#include "physics/body/law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f = -s G m M0 r/|r|^3,  E = -s G m M0/|r|,  r = x - x0; singular at r = 0;  s = 1, but in load steps
struct CentralGravity {
  static constexpr const char* title = "central gravity";
  static constexpr Potential potential = Potential::of_position;
  double G = 6.6743e-11;     ///< constant of gravitation [m^3/(kg s^2)] (CODATA 2018)
  double M0 = 0;             ///< central mass [kg]; off: 0
  double x0[3] = {0, 0, 0};  ///< its place [m]
  int components = 1;        ///< how many of x0 were given
  double load = 1;           ///< s, the factor of the load step

  template <class V>
  void options(V& o) {
    using R = RangeOf<V>;
    const bool constant = o.real("-bs_central_G", "gravitational constant G, >= 0 [m^3/(kg s^2)]", G, R::nonnegative);
    const bool mass = o.real("-bs_central_M0", "mass M0 that attracts every particle, >= 0; 0: none [kg]", M0, R::nonnegative);
    const bool point = read_vector(o, "-bs_central_point", "position x,y[,z] of the mass M0 [m]", x0, components);
    if (constant) require(o, mass, "-bs_central_G", "-bs_central_M0");
    if (point) require(o, mass, "-bs_central_point", "-bs_central_M0");
  }
  bool active() const noexcept { return M0 != 0; }
  std::string describe() const { return "central gravity G M0 = " + short_number(G * M0) + " m^3/s^2 at " + vector_text(x0, components) + " m"; }

  template <int d>
  double energy(const Point<d>& p) const noexcept {
    double r[d];
    return -load * G * M0 * p.m / distance<d>(p, r);
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    double r[d];
    const double l = distance<d>(p, r);
    const double q = load * G * M0 * p.m / (l * l * l);
    if (!std::isfinite(q)) return false;
    for (int i = 0; i < d; ++i) f[i] -= q * r[i];
    return true;
  }
  /// df/dx = -G m M0/|r|^3 (I - 3 u u^T),  u = r/|r|; adds nothing at r = 0
  template <int d>
  void dfdx(const Point<d>& p, double* K) const noexcept {
    double r[d];
    const double l = distance<d>(p, r);
    const double q = load * G * M0 * p.m / (l * l * l);
    if (!std::isfinite(q)) return;
    for (int i = 0; i < d; ++i) r[i] /= l;
    add_tensor<d>(-q, 3 * q, r, K);
  }
  template <int d>
  void dfdv(const Point<d>&, double*) const noexcept {}

 private:
  template <int d>
  double distance(const Point<d>& p, double* r) const noexcept {
    for (int i = 0; i < d; ++i) r[i] = p.x[i] - x0[i];
    return norm<d>(r);
  }
};

}  // namespace bs
