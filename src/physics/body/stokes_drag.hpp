// Linear drag, the same for every particle.
#pragma once
#include <string>

#include "physics/body/law_options.hpp"
#include "physics/body/point.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f = -D v
struct StokesDrag {
  static constexpr const char* title = "Stokes drag";
  static constexpr Potential potential = Potential::of_velocity;
  double D = 0;  ///< drag coefficient [kg/s], 6 pi mu a for a sphere in creeping flow; off: 0

  template <class V>
  void options(V& o) {
    o.real("-bs_stokes_drag", "coefficient D of the linear drag force -D v, >= 0; 0: none [kg/s]", D, RangeOf<V>::nonnegative);
  }
  bool active() const noexcept { return D != 0; }
  std::string describe() const { return "Stokes drag D = " + short_number(D) + " kg/s"; }

  /// No potential: 0.
  template <int d>
  double energy(const Point<d>&) const noexcept {
    return 0;
  }
  /// R = D/2 |v|^2:  R(v + dv) - R(v) - R'(v).dv = D/2 |dv|^2
  template <int d>
  double dissipation_beyond_slope(const Point<d>&, const double* dv) const noexcept {
    return 0.5 * D * dot<d>(dv, dv);
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    for (int i = 0; i < d; ++i) f[i] -= D * p.v[i];
    return true;
  }
  template <int d>
  void dfdx(const Point<d>&, double*) const noexcept {}
  template <int d>
  void dfdv(const Point<d>&, double* A) const noexcept {
    for (int i = 0; i < d; ++i) A[d * i + i] -= D;
  }
};

}  // namespace bs
