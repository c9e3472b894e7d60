// The incremental potential of an implicit step, for searches along a Newton direction.
#pragma once
#include <petscvec.h>
#include <limits>
#include <string>

namespace bs {

/// What a potential changes by, beyond its slope, and the rounding error in that.
struct PotentialChange {
  double value = 0, noise = 0;
};

/// Belongs to a model whose residual F_x = M (sigma x - v) + a, F_v = sigma M v - f(t, x, v) + b (a, b constant during the
/// solve: beuler, theta, cn, bdf) is, where the forces have a potential E(x) and one of dissipation R(v), the gradient
/// F_v = dPhi/dv of
///   Phi(v) = sigma/2 v.M v + b.v + sigma E(x(v)) + R(v),   x(v): F_x = 0.
/// Phi is a power [W]: the incremental potential of the step times sigma.
class Incremental {
 public:
  virtual ~Incremental() = default;
  /// Empty, or what acts without such a potential.
  virtual std::string lacks_potential() const = 0;
  /// v += M^-1 F_x in y = (x, v): with F the residual at y, the velocity at which F_x vanishes.
  virtual PetscErrorCode add_kinematic(Vec F, Vec y) = 0;
  /// Collective. Keeps the line y + lambda z; z_x = z_v/sigma, zero at fixed particles.
  virtual PetscErrorCode follow(Vec y, Vec z) = 0;
  /// Collective. Phi(v + lambda z_v) - Phi(v) - lambda F_v.z_v on the line kept. Summed from terms that are of second order
  /// each, so that nothing cancels however large Phi is. Not finite: a law has no value there.
  virtual PetscErrorCode beyond_slope(double t, double sigma, double lambda, PotentialChange* change) = 0;
  /// Whether forces limit how far a state may go at once; the same on every rank, and also where they have no potential.
  virtual bool limits_steps() const { return false; }
  /// Collective. The largest lambda that they allow on the line kept, of which the positions alone count: infinite where all may be, 0 where none.
  virtual PetscErrorCode largest_lambda(double /* t */, double* lambda) {
    *lambda = std::numeric_limits<double>::infinity();
    return 0;
  }
};

}  // namespace bs
