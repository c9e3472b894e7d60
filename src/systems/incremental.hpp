// The incremental potential of an implicit step, for searches along a Newton direction.
#pragma once
#include <petscvec.h>
#include <limits>
#include <string>

namespace bs {

/// Change of a potential beyond its slope, and the rounding error of that change.
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
  /// The name of a force that has no such potential; empty: all forces have one.
  virtual std::string lacks_potential() const = 0;
  /// Adds M^-1 F_x to v in y = (x, v), where F is the residual at y: F_x vanishes at the new velocity.
  virtual PetscErrorCode add_kinematic(Vec F, Vec y) = 0;
  /// Collective. Sets the line y + lambda z that the functions below use; z_x = z_v/sigma, and z is zero at fixed particles.
  virtual PetscErrorCode follow(Vec y, Vec z) = 0;
  /// Collective. Phi(v + lambda z_v) - Phi(v) - lambda F_v.z_v on that line. Summed from terms of second
  /// order, so that nothing cancels however large Phi is. Not finite where a law is not defined.
  virtual PetscErrorCode beyond_slope(double t, double sigma, double lambda, PotentialChange* change) = 0;
  /// Whether forces limit how far a state may go at once; the same on every rank, and also where they have no potential.
  virtual bool limits_steps() const { return false; }
  /// Collective. The largest lambda that forces allow on that line, by its positions alone: infinite where there is no limit, 0 where no step is
  /// allowed.
  virtual PetscErrorCode largest_lambda(double /* t */, double* lambda) {
    *lambda = std::numeric_limits<double>::infinity();
    return 0;
  }
};

}  // namespace bs
