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

}  // namespace bs
