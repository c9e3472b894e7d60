// What a particle law sees: one particle at one moment.
#pragma once
#include "lattice/columns.hpp"

namespace bs {

/// One particle in d dimensions. x and v point at d numbers each.
template <int d>
struct Point {
  double t;             ///< time [s]
  double m;             ///< mass [kg]
  ParticleNumbers own;  ///< its other numbers
  const double* x;      ///< position [m]
  const double* v;      ///< velocity [m/s]

  /// Its number at place k of `particle_parameters`.
  double column(std::size_t k) const noexcept { return own[k]; }
};

/// What a law's force derives from: nothing; E(x) that is linear in x; E(x); or a dissipation potential R(v), f = -dR/dv.
enum class Potential { none, linear, of_position, of_velocity };

}  // namespace bs
