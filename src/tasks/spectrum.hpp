// How fast a mechanical system can oscillate, from a few evaluations of its forces.
#pragma once
#include <petscvec.h>
#include "systems/mechanics.hpp"

namespace bs {

/// Of M x'' = f(t, x, x') near a state, with K = -df/dx and D = -df/dv. A rate that cannot be determined is 0.
struct Spectrum {
  double omega_max = 0;   ///< bound of sqrt(largest eigenvalue of M^-1 K): Ritz value plus its residual [1/s]
  double omega_ritz = 0;  ///< the Ritz value alone: never above the exact one [1/s]
  double damping = 0;     ///< largest eigenvalue of M^-1 D [1/s]
  double motion = 0;      ///< sqrt(d.K d / d.M d) along the present velocity d; 0 at rest, where accelerations say little [1/s]
  int evaluations = 0;    ///< of the forces: at most 15
  double seconds = 0;     ///< that one of them took, the quickest, on the slowest rank [s]
};

/// Collective. y is a state of `mechanics`. The result is the same on any number of ranks up to rounding. Forces that are not finite nearby give
/// zeros.
PetscErrorCode estimate_spectrum(Mechanics& mechanics, double t, Vec y, Spectrum* out);

}  // namespace bs
