// Linear drag with a coefficient of each particle.
#pragma once
#include <string>

#include "physics/body/point.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f = -c v, c the particle's own coefficient [kg/s]; acts beside Stokes drag, where a lattice has the column.
struct ParticleDrag {
  static constexpr const char* title = "drag of each particle";
  static constexpr Potential potential = Potential::of_velocity;
  static constexpr std::size_t column = particle_parameter("drag");
  bool given = false;  ///< the lattice has the column

  template <class V>
  void options(V&) {}
  bool active() const noexcept { return given; }
  std::string describe() const { return "drag -c v, c of each particle from the lattice"; }

  /// No potential: 0.
  template <int d>
  double energy(const Point<d>&) const noexcept {
    return 0;
  }
  /// R = c/2 |v|^2:  R(v + dv) - R(v) - R'(v).dv = c/2 |dv|^2
  template <int d>
  double dissipation_beyond_slope(const Point<d>& p, const double* dv) const noexcept {
    return 0.5 * p.column(column) * dot<d>(dv, dv);
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    for (int i = 0; i < d; ++i) f[i] -= p.column(column) * p.v[i];
    return true;
  }
  template <int d>
  void dfdx(const Point<d>&, double*) const noexcept {}
  template <int d>
  void dfdv(const Point<d>& p, double* A) const noexcept {
    for (int i = 0; i < d; ++i) A[d * i + i] -= p.column(column);
  }
};

}  // namespace bs
