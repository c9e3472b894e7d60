// Descent directions from a matrix that is not positive definite, by the absolute values of its curvatures.
#pragma once
#include <petscksp.h>
#include <vector>
#include "base/handle.hpp"

namespace bs {

/// S symmetric, P positive definite, V an orthonormal basis, by P, of the Krylov space of P^-1 S and P^-1 b (Lanczos), T = V^T S V:
///   w = V |T|^-1 V^T b
/// descends where b is the negative gradient, and goes along negative curvature as far as along positive curvature of that size. As
/// long as T is positive definite it is the iterate of conjugate gradients.
class AbsoluteSolve {
 public:
  static constexpr PetscInt MOST = 100;  ///< iterations, each of which keeps a vector
  struct Outcome {
    PetscInt iterations = 0;
    bool negative = false;  ///< T has negative curvature
    bool sound = false;     ///< there is a w: P is positive definite, and everything is finite
  };
  /// Collective. w solves |T| y = V^T b up to rtol of b, both by P^-1; up to `loose` where T has negative curvature.
  PetscErrorCode solve(Mat S, PC P, Vec b, Vec w, double rtol, double loose, Outcome* out);

 private:
  PetscErrorCode begin(Vec b, Vec w);
  PetscErrorCode extend(Mat S);
  PetscErrorCode weigh(PC P, bool* ends);
  PetscErrorCode find_coordinates(bool* negative);
  std::vector<VecHandle> basis_;           ///< columns of V; kept for the next solve
  VecHandle now_, before_, next_;          ///< P times columns of V
  std::vector<double> diagonal_, beside_;  ///< of T
  std::vector<double> y_;                  ///< |T|^-1 V^T b
  double norm_ = 0, first_ = 0;            ///< of the last residual and of b, by P^-1
};

}  // namespace bs
