// Uniform gravity.
#pragma once
#include <string>

#include "physics/body/displaced_fluid.hpp"
#include "physics/body/law_options.hpp"
#include "physics/body/point.hpp"
#include "physics/vector.hpp"

namespace bs {

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
