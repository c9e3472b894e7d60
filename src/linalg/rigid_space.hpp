// The correction of motions over many pairs for thin bodies, in whose bending hats on a coarse grid are much too stiff: with rigid motions Z
// of groups of points where they are at present,
//   z += Z E^-1 Z^T r,   E = Z^T S Z
// E is sparse, since only groups that touch are coupled; its factors are kept on every rank. Groups belong to one rank and overlap
// those of the same rank alone.
#pragma once
#include <petscksp.h>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "linalg/pair_matrix.hpp"
#include "linalg/rigid_motions.hpp"

namespace bs {

class RigidSpace {
 public:
  /// Collective. Of the present S, with about `unknowns` coarse unknowns at most; -1: by the number of points. `prefix`: of the options of
  /// the solver of E.
  PetscErrorCode create(PairMatrix& S, PetscInt unknowns, const std::string& prefix);
  /// False where E cannot be factored or there is nothing to gain; then add() does nothing.
  bool active() const { return active_; }
  PetscInt unknowns() const { return unknowns_; }
  /// Collective. z += Z E^-1 Z^T r; vectors of block size d of the owned points.
  PetscErrorCode add(Vec r, Vec z);

 private:
  PetscErrorCode make(PairMatrix& S, PetscInt unknowns, const std::string& prefix);
  PetscErrorCode factor(Mat E, const std::string& prefix);
  const Graph* graph_ = nullptr;
  bool active_ = false, grouped_ = false;
  PetscInt unknowns_ = 0;
  RigidGroups groups_;
  RigidMotions motions_;
  PCHandle factors_;
  VecHandle in_, out_;
  std::vector<double> free_, moved_;  ///< where components are held: r and what is added, without held components
};

/// Collective. E = Z^T S Z, summed pair by pair, as an AIJ matrix whose rows are laid out as the ranks' groups. Unknowns that move nothing have 1
/// on the diagonal. The rows of Z that belong to held components are zero.
PetscErrorCode create_coarse_matrix(PairMatrix& S, const RigidMotions& motions, Mat* E);

}  // namespace bs
