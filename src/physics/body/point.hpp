// What a particle law sees: one particle at one moment.
#pragma once

namespace bs {

/// One particle in d dimensions. x and v point at d numbers each.
template <int d>
struct Point {
  double t;         ///< time [s]
  double m;         ///< mass [kg]
  double a;         ///< radius [m], 0 where the lattice gives none
  const double* x;  ///< position [m]
  const double* v;  ///< velocity [m/s]
};

/// What a law's force derives from: nothing; E(x) that is linear in x; E(x); or a dissipation potential R(v), f = -dR/dv.
enum class Potential { none, linear, of_position, of_velocity };

}  // namespace bs
