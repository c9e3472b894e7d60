// The correction of motions over many springs, which incomplete factors do not resolve. With the hats Z of a coarse grid over the
// lattice as it started,
//   z += Z E^-1 Z^T r,   E = Z^T S Z
// Particles tied by springs much stiffer than the others share the values at their centre, so that no coarse motion
// strains such a spring. Held components of rollers have no share in any hat, as fixed particles have none. E is small and sparse; its factors are
// kept on every rank.
#pragma once
#include <vector>
#include "systems/particles/condensed/coarse_factors.hpp"
#include "systems/particles/condensed/coarse_grid.hpp"
#include "systems/particles/condensed/spring_matrix.hpp"

namespace bs {

class CoarseSpace {
 public:
  /// Collective. Of the present S, with at most `unknowns` coarse unknowns; -1: by the lattice's size.
  PetscErrorCode create(SpringMatrix& S, PetscInt unknowns);
  /// False where E is not positive definite or there is nothing to gain; then add() does nothing.
  bool active() const { return active_; }
  PetscInt unknowns() const { return grid_.nodes() * dim_; }
  /// Collective. z += Z E^-1 Z^T r; vectors of block size d of the owned particles.
  PetscErrorCode add(Vec r, Vec z);

 private:
  PetscErrorCode reserve(double neighbours) const;
  PetscErrorCode make(SpringMatrix& S, PetscInt unknowns);
  PetscErrorCode factor(SpringMatrix& S);
  void keep_held(double* z, bool restore);
  MPI_Comm comm_ = MPI_COMM_NULL;
  int dim_ = 3;
  bool active_ = false;
  const Supports* supports_ = nullptr;  ///< where there are rollers
  PetscInt owned_ = 0;
  CoarseGrid grid_;
  CoarseFactors factors_;
  std::vector<double> lanes_, in_, out_;  ///< of one solve
  std::vector<double> free_, kept_;       ///< with rollers: r without held components, and what these have in z
};

}  // namespace bs
