// The correction of motions over many pairs, which incomplete factors do not resolve. With the hats Z of a coarse grid over the
// points as they started,
//   z += Z E^-1 Z^T r,   E = Z^T S Z
// Points tied by pairs much stiffer than the others share the values at their centre, so that no coarse motion
// strains such a pair. Held components have no share in any hat, as fixed points have none. E is small and sparse; its factors are
// kept on every rank.
#pragma once
#include <vector>
#include "linalg/coarse_factors.hpp"
#include "linalg/hat_grid.hpp"
#include "linalg/pair_matrix.hpp"

namespace bs {

class HatSpace {
 public:
  /// Collective. Of the present S, with at most `unknowns` coarse unknowns; -1: by the number of points.
  PetscErrorCode create(PairMatrix& S, PetscInt unknowns);
  /// False where E is not positive definite or there is nothing to gain; then add() does nothing.
  bool active() const { return active_; }
  PetscInt unknowns() const { return grid_.nodes() * dim_; }
  /// Collective. z += Z E^-1 Z^T r; vectors of block size d of the owned points.
  PetscErrorCode add(Vec r, Vec z);

 private:
  PetscErrorCode reserve(double neighbours) const;
  PetscErrorCode make(PairMatrix& S, PetscInt unknowns);
  PetscErrorCode factor(PairMatrix& S);
  MPI_Comm comm_ = MPI_COMM_NULL;
  int dim_ = 3;
  bool active_ = false;
  const Graph* graph_ = nullptr;
  HatGrid grid_;
  CoarseFactors factors_;
  std::vector<double> lanes_, in_, out_;  ///< of one solve
  std::vector<double> free_, kept_;       ///< where components are held: r without these, and what they have in z
};

}  // namespace bs
