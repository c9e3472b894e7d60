// Uniform gravity, and what the fluid that a sphere displaces does to it beside drag: buoyancy and added mass.
#pragma once
#include <string>
#include "physics/body/law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// Of a sphere of radius a in a fluid of density rho, V = 4/3 pi a^3:
///   buoyancy    -rho V g, so that (m - rho V) g is left of its weight
///   added mass  C rho V, accelerated along with it: (m + C rho V) x'' = f. Without viscosity C = 1/2 (Lamb, Hydrodynamics)
struct DisplacedFluid {
  static constexpr std::size_t column = particle_parameter("radius");
  bool buoyant = false;
  double added = 0;        ///< C [1]; off: 0
  double rho = 0;          ///< [kg/m^3]
  bool rho_given = false;  ///< by its own option
  double radius = 0;       ///< of particles whose own radius is 0 [m]

  template <class V>
  void options(V& o) {
    using R = RangeOf<V>;
    o.flag("-bs_buoyancy", "buoyancy of the particles as spheres of radius a: (m - rho V) g is left of the weight in uniform gravity, V = 4/3 pi a^3",
           buoyant);
    o.real("-bs_added_mass",
           "added mass C rho V of the particles as spheres, which is accelerated along with each: coefficient C, 0.5 of a sphere, 0: none [1]", added,
           R::nonnegative);
    rho_given =
        o.real("-bs_fluid_density",
               "density of the fluid for buoyancy and added mass; left out where -bs_sphere_drag_rho or -bs_shape_drag_rho says it, > 0 [kg/m^3]",
               rho, R::positive);
  }
  bool active() const noexcept { return buoyant || added != 0; }
  std::string describe() const {
    std::string text = "spheres in a fluid of " + short_number(rho) + " kg/m^3:";
    if (buoyant) text += " buoyancy";
    if (added != 0) text += std::string(buoyant ? " and" : "") + " added mass " + short_number(added) + " rho V";
    return text;
  }
  /// Radius a of a particle with the numbers `own`.
  double radius_of(const ParticleNumbers& own) const noexcept { return own[column] > 0 ? own[column] : radius; }
  /// rho V
  double mass(const ParticleNumbers& own) const noexcept {
    constexpr double pi = 3.14159265358979323846;
    const double a = radius_of(own);
    return 4.0 / 3.0 * pi * rho * a * a * a;
  }
};

/// f = s m g,  E = -s m g.x;  s = 1, but in load steps; in a fluid that lifts it m - rho V in the place of m
struct UniformGravity {
  static constexpr const char* title = "uniform gravity";
  static constexpr Potential potential = Potential::linear;
  double g[3] = {0, 0, 0};  ///< acceleration [m/s^2]; off: 0 (standard gravity of the Earth: 9.80665)
  int components = 1;       ///< how many of g were given
  double load = 1;          ///< s, the factor of the load step
  DisplacedFluid fluid;     ///< lifts the particle where it is buoyant

  template <class V>
  void options(V& o) {
    read_vector(o, "-bs_gravity", "uniform gravitational acceleration gx[,gy[,gz]] [m/s^2]", g, components);
  }
  bool active() const noexcept { return g[0] != 0 || g[1] != 0 || g[2] != 0; }
  std::string describe() const { return "uniform gravity g = " + vector_text(g, components) + " m/s^2"; }

  template <int d>
  double energy(const Point<d>& p) const noexcept {
    return -load * heavy(p) * dot<d>(g, p.x);
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    const double m = heavy(p);
    for (int i = 0; i < d; ++i) f[i] += load * m * g[i];
    return true;
  }
  template <int d>
  void dfdx(const Point<d>&, double*) const noexcept {}
  template <int d>
  void dfdv(const Point<d>&, double*) const noexcept {}

 private:
  template <int d>
  double heavy(const Point<d>& p) const noexcept {
    return fluid.buoyant ? p.m - fluid.mass(p.own) : p.m;
  }
};

}  // namespace bs
