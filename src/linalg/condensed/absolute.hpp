// Descent directions from a matrix that is not positive definite, by the absolute values of its curvatures.
#pragma once
#include <petscksp.h>
#include <vector>
#include "base/handle.hpp"

namespace bs {

/// S symmetric, P positive definite, V an orthonormal basis, by P, of the Krylov space of P^-1 S and P^-1 b (Lanczos), T = V^T S V:
///   w = V |T|^-1 V^T b
/// descends where b is the negative gradient, and goes along negative curvature as far as along positive curvature of that size. As
/// long as T is positive definite it is the iterate of conjugate gradients, for which V is not needed: only the first KEPT columns are kept.
/// Negative curvature that shows later ends the solve with the iterate before it.
class AbsoluteSolve {
 public:
  static constexpr PetscInt KEPT = 100;
  struct Demand {
    double rtol = 1e-5, loose = 0.1;  ///< the latter where T has negative curvature
    PetscInt most = 10000;            ///< iterations
  };
  struct Outcome {
    PetscInt iterations = 0;
    bool negative = false;  ///< T has negative curvature
    bool sound = false;     ///< there is a w: P is positive definite, and everything is finite
  };
  /// Collective. w solves |T| y = V^T b up to the demanded part of b, both by P^-1.
  PetscErrorCode solve(Mat S, PC P, Vec b, Vec w, const Demand& demand, Outcome* out);

 private:
  PetscErrorCode begin(Vec b, Vec w);
  PetscErrorCode extend(Mat S, double* alpha);
  PetscErrorCode weigh(PC P, bool* ends);
  PetscErrorCode conjugate(double alpha, Vec w);
  PetscErrorCode test_residual(const Demand& demand, bool* enough);
  PetscErrorCode find_coordinates();
  PetscErrorCode keep();
  PetscErrorCode combine(Vec w) const;
  /// Columns of V, the numbers of this rank; room stays for the next solve. In single precision, which is enough for a direction: 1.2 kB a
  /// particle of three dimensions if all are in use.
  std::vector<std::vector<float>> basis_;
  VecHandle column_;                       ///< the last column of V
  VecHandle now_, before_, next_;          ///< P times columns of V
  VecHandle along_;                        ///< direction of conjugate gradients
  bool definite_ = true;                   ///< T
  double next_test_ = 1;                   ///< iteration at which to look at y_ again
  double pivot_ = 0, advance_ = 0;         ///< last of T = L D L^T, and of what solves L D (..) = V^T b
  std::vector<double> diagonal_, beside_;  ///< of T
  std::vector<double> y_;                  ///< |T|^-1 V^T b
  double norm_ = 0, first_ = 0;            ///< of the last residual and of b, by P^-1
};

}  // namespace bs
