// A coarse correction for long-range motions, which incomplete factors do not resolve. With coarse functions Z
//   z += Z E^-1 Z^T r,   E = Z^T S Z
// Z are hats on a grid over the points as they started (hat_grid.hpp), small clusters of stiff pairs being one point, or rigid motions of groups of
// points where they are at present (rigid_motions.hpp), for thin bodies, in whose bending hats are much too stiff. Held components have no share in
// any function, as fixed points have none. E is sparse; its factors are kept on every rank.
#pragma once
#include <vector>
#include "linalg/coarse_matrix.hpp"
#include "linalg/hat_grid.hpp"
#include "linalg/pair_matrix.hpp"
#include "linalg/rigid_motions.hpp"

namespace bs {

class CoarseSpace {
 public:
  /// Collective. Builds the coarse space for the present S with at most about `unknowns` coarse unknowns; -1: chosen by the number of points.
  PetscErrorCode create(PairMatrix& S, bool rigid, PetscInt unknowns);
  /// False where a coarse space has nothing to gain, E cannot be factored, or hats (which are added to incomplete factors) would make the
  /// preconditioner indefinite; add() then does nothing.
  bool active() const { return active_; }
  bool rigid() const { return rigid_; }
  PetscInt unknowns() const { return E_.unknowns(); }
  /// Collective. z += Z E^-1 Z^T r; vectors of block size d of the owned points.
  PetscErrorCode add(Vec r, Vec z);

 private:
  PetscErrorCode make(PairMatrix& S, PetscInt unknowns);
  PetscErrorCode make_grid(PairMatrix& S, PetscInt unknowns);
  PetscErrorCode make_motions(PairMatrix& S, PetscInt unknowns);
  const Graph* graph_ = nullptr;
  bool active_ = false, rigid_ = false, grouped_ = false;
  double least_ = 0;  ///< the smallest size of a pair that hats treat as stiff
  HatGrid grid_;
  RigidGroups groups_;
  RigidMotions motions_;
  CoarseMatrix E_;
  double shares_ = 0;                ///< multiplications that one product with Z takes
  std::vector<double> in_, out_;     ///< work vectors of one solve
  std::vector<double> free_, kept_;  ///< where components are held: r without them, and their values in z
};

}  // namespace bs
