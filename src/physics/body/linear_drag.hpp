// Drag in proportion to the velocity: the same for every particle, in proportion to its mass, or with a coefficient of its own.
#pragma once
#include <string>

#include "physics/body/law.hpp"
#include "physics/vector.hpp"

namespace bs {

/// f = -c v, where Law::coefficient(p) is c [kg/s].
template <class Law>
struct LinearDrag {
  static constexpr Potential potential = Potential::of_velocity;

  /// No potential: 0.
  template <int d>
  double energy(const Point<d>&) const noexcept {
    return 0;
  }
  /// R = c/2 |v|^2:  R(v + dv) - R(v) - R'(v).dv = c/2 |dv|^2
  template <int d>
  double dissipation_beyond_slope(const Point<d>& p, const double* dv) const noexcept {
    return 0.5 * of(p) * dot<d>(dv, dv);
  }
  template <int d>
  bool force(const Point<d>& p, double* f) const noexcept {
    const double c = of(p);
    for (int i = 0; i < d; ++i) f[i] -= c * p.v[i];
    return true;
  }
  template <int d>
  void dfdx(const Point<d>&, double*) const noexcept {}
  template <int d>
  void dfdv(const Point<d>& p, double* A) const noexcept {
    const double c = of(p);
    for (int i = 0; i < d; ++i) A[d * i + i] -= c;
  }

 private:
  template <int d>
  double of(const Point<d>& p) const noexcept {
    return static_cast<const Law*>(this)->coefficient(p);
  }
};

/// f = -D v
struct StokesDrag : LinearDrag<StokesDrag> {
  static constexpr const char* title = "Stokes drag";
  double D = 0;  ///< drag coefficient [kg/s], 6 pi mu a for a sphere in creeping flow; off: 0

  template <class V>
  void options(V& o) {
    o.real("-bs_stokes_drag", "coefficient D of the linear drag force -D v, >= 0; 0: none [kg/s]", D, RangeOf<V>::nonnegative);
  }
  bool active() const noexcept { return D != 0; }
  std::string describe() const { return "Stokes drag D = " + short_number(D) + " kg/s"; }
  template <int d>
  double coefficient(const Point<d>&) const noexcept {
    return D;
  }
};

/// f = -c m v  (`visc` of .xsp files): the same deceleration for every particle.
struct MassDrag : LinearDrag<MassDrag> {
  static constexpr const char* title = "viscosity";
  double c = 0;  ///< rate at which a velocity decays [1/s]; off: 0

  template <class V>
  void options(V& o) {
    o.real("-bs_viscosity", "rate c of the drag force -c m v, proportional to mass, >= 0; 0: none [1/s]", c, RangeOf<V>::nonnegative);
  }
  bool active() const noexcept { return c != 0; }
  std::string describe() const { return "viscosity c = " + short_number(c) + " 1/s"; }
  template <int d>
  double coefficient(const Point<d>& p) const noexcept {
    return c * p.m;
  }
};

/// f = -c v, c the particle's own coefficient [kg/s]; acts beside Stokes drag, where a lattice has the column.
struct ParticleDrag : LinearDrag<ParticleDrag> {
  static constexpr const char* title = "drag of each particle";
  static constexpr std::size_t column = particle_parameter("drag");
  bool given = false;  ///< the lattice has the column

  template <class V>
  void options(V&) {}
  bool active() const noexcept { return given; }
  std::string describe() const { return "drag -c v, c of each particle from the lattice"; }
  template <int d>
  double coefficient(const Point<d>& p) const noexcept {
    return p.column(column);
  }
};

}  // namespace bs
