// Drag of a sphere at any Reynolds number.
#pragma once
#include <cmath>
#include <string>

#include "physics/body/law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f = -1/2 rho pi a^2 C_D |u| u,  u = v - u_fluid,  C_D = 24/Re + 6/(1 + sqrt(Re)) + 0.4,  Re = 2 a rho |u|/mu
/// (White, Viscous Fluid Flow; for Re up to 2e5). The term 24/Re is written out, so that nothing is infinite at u = 0:
///   f = -(6 pi mu a + k h(s)) u,  s = |u|,  k = rho pi a^2/2,  h(s) = 6 s/(1 + sqrt(Re)) + 0.4 s
struct SphereDrag {
  static constexpr const char* title = "sphere drag";
  static constexpr Potential potential = Potential::none;
  static constexpr std::size_t column = particle_parameter("radius");
  bool on = false;
  double rho = 0;               ///< density of the fluid [kg/m^3]
  double mu = 0;                ///< dynamic viscosity of the fluid [Pa s]
  double fluid[3] = {0, 0, 0};  ///< velocity of the fluid [m/s]
  int components = 1;           ///< how many of `fluid` were given
  double radius = 0;            ///< of particles whose own radius is 0 [m]

  template <class V>
  void options(V& o) {
    using R = RangeOf<V>;
    const bool said = o.flag("-bs_sphere_drag", "drag force on a sphere, with the drag coefficient C_D = 24/Re + 6/(1+sqrt(Re)) + 0.4", on);
    const bool density = o.real("-bs_sphere_drag_rho", "sphere drag: density of the fluid, >= 0 [kg/m^3]", rho, R::nonnegative);
    const bool viscosity = o.real("-bs_sphere_drag_mu", "sphere drag: viscosity of the fluid, > 0 [Pa s]", mu, R::positive);
    read_fluid(o, fluid, components);
    o.real("-bs_radius", "radius of the particles for which the lattice gives none, >= 0 [m]", radius, R::nonnegative);
    if (density) require(o, said, "-bs_sphere_drag_rho", "-bs_sphere_drag");
    if (viscosity) require(o, said, "-bs_sphere_drag_mu", "-bs_sphere_drag");
    if (!on) return;
    require(o, density, "-bs_sphere_drag", "-bs_sphere_drag_rho, the density of the fluid [kg/m^3]");
    require(o, viscosity, "-bs_sphere_drag", "-bs_sphere_drag_mu, the viscosity of the fluid [Pa s]");
  }
  bool active() const noexcept { return on; }
  std::string describe() const {
    std::string text = "sphere drag rho = " + short_number(rho) + " kg/m^3, mu = " + short_number(mu) + " Pa s";
    if (radius > 0) text += ", radius " + short_number(radius) + " m where the lattice gives none";
    return text + fluid_text(fluid, components);
  }

  /// No potential: 0.
  template <int d>
  double energy(const Point<d>&) const noexcept {
    return 0;
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    double u[d];
    const Coefficients c = coefficients<d>(p, u);
    for (int i = 0; i < d; ++i) f[i] -= c.along * u[i];
    return true;
  }
  template <int d>
  void dfdx(const Point<d>&, double*) const noexcept {}
  /// df/dv = -(6 pi mu a + k h) I - k h'(s) s n n^T,  n = u/s;  at u = 0: -6 pi mu a I
  template <int d>
  void dfdv(const Point<d>& p, double* D) const noexcept {
    double n[d];
    const Coefficients c = coefficients<d>(p, n);
    if (c.speed > 0)
      for (int i = 0; i < d; ++i) n[i] /= c.speed;
    add_tensor<d>(-c.along, -c.slope * c.speed, n, D);
  }

 private:
  struct Coefficients {
    double speed, along, slope;  ///< s [m/s], 6 pi mu a + k h(s) [kg/s], k h'(s) [kg/m]
  };

  template <int d>
  Coefficients coefficients(const Point<d>& p, double* u) const noexcept {
    constexpr double pi = 3.14159265358979323846;
    for (int i = 0; i < d; ++i) u[i] = p.v[i] - fluid[i];
    const double own = p.column(column), a = own > 0 ? own : radius, s = norm<d>(u);
    const double root = std::sqrt(2 * a * rho * s / mu);  // sqrt(Re)
    const double k = 0.5 * rho * pi * a * a, w = 1 / (1 + root);
    // h'(s) = 6/(1 + sqrt(Re)) - 3 sqrt(Re)/(1 + sqrt(Re))^2 + 0.4, because s d(sqrt(Re))/ds = sqrt(Re)/2
    return {s, 6 * pi * mu * a + k * s * (6 * w + 0.4), k * (6 * w - 3 * root * w * w + 0.4)};
  }
};

}  // namespace bs
