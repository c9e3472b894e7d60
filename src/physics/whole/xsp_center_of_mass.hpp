// Pull of the centre of mass to a centre, "frce 1" of .xsp scenes. It couples all particles with all, so it is applied
// by the model and is not among the particle laws.
#pragma once
#include <string>

#include "physics/body/law.hpp"

namespace bs {

/// Every particle concerned is accelerated alike:  a = -(value (X - C) + damping V)/S,
/// X and V: position and velocity of the centre of mass of the particles concerned, S: the sum of their masses, C: the
/// centre. Concerned are the free particles, less the one that is the centre. The division by S is part of the law as
/// scenes mean it: the resultant force S a does not depend on S.
struct XspCenterOfMass {
  static constexpr const char* title = "pull of the centre of mass";
  double value = 0;    ///< force of the whole per displacement [N/m]; < 0 repels; off: 0
  double damping = 0;  ///< force of the whole per velocity [kg/s]; off: 0

  template <class V>
  void options(V& o) {
    o.real("-bs_xsp_center_of_mass", "XSpringies force that pulls the centre of mass toward the centre: stiffness; a negative value repels [N/m]",
           value);
    o.real("-bs_xsp_center_of_mass_damping", "XSpringies force against the velocity of the centre of mass: damping [kg/s]", damping);
  }
  bool active() const noexcept { return value != 0 || damping != 0; }
  std::string describe() const { return "pull of the centre of mass " + short_number(value) + " N/m, damping " + short_number(damping) + " kg/s"; }

  /// value/2 |X - C|^2, of which the forces on the particles concerned are the slopes where C is at rest.
  template <int d>
  double energy(const double* X, const double* C) const noexcept {
    double square = 0;
    for (int i = 0; i < d; ++i) square += (X[i] - C[i]) * (X[i] - C[i]);
    return value / 2 * square;
  }
  /// ADDS the acceleration to a[d]; S > 0. da/dX = -value/S I, da/dV = -damping/S I, da/dC = value/S I.
  template <int d>
  void acceleration(const double* X, const double* V, const double* C, double S, double* a) const noexcept {
    for (int i = 0; i < d; ++i) a[i] -= (value * (X[i] - C[i]) + damping * V[i]) / S;
  }
};

}  // namespace bs
