// Linear drag in proportion to the mass: the same deceleration for every particle.
#pragma once
#include <string>

#include "physics/body/law_options.hpp"
#include "physics/body/point.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f = -c m v  (`visc` of .xsp files)
struct MassDrag {
  static constexpr const char* title = "viscosity";
  static constexpr Potential potential = Potential::of_velocity;
  double c = 0;  ///< rate at which a velocity decays [1/s]; off: 0

  template <class V>
  void options(V& o) {
    o.real("-bs_viscosity", "rate c of the drag force -c m v, proportional to mass, >= 0; 0: none [1/s]", c, RangeOf<V>::nonnegative);
  }
  bool active() const noexcept { return c != 0; }
  std::string describe() const { return "viscosity c = " + short_number(c) + " 1/s"; }

  /// No potential: 0.
  template <int d>
  double energy(const Point<d>&) const noexcept {
    return 0;
  }
  /// R = c m/2 |v|^2:  R(v + dv) - R(v) - R'(v).dv = c m/2 |dv|^2
  template <int d>
  double dissipation_beyond_slope(const Point<d>& p, const double* dv) const noexcept {
    return 0.5 * c * p.m * dot<d>(dv, dv);
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    for (int i = 0; i < d; ++i) f[i] -= c * p.m * p.v[i];
    return true;
  }
  template <int d>
  void dfdx(const Point<d>&, double*) const noexcept {}
  template <int d>
  void dfdv(const Point<d>& p, double* D) const noexcept {
    for (int i = 0; i < d; ++i) D[d * i + i] -= c * p.m;
  }
};

}  // namespace bs
