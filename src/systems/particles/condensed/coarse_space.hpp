// The correction of motions over many springs, which incomplete factors do not resolve: with rigid motions Z of groups of particles,
//   z += Z E^-1 Z^T r,   E = Z^T S Z
// E is sparse, since only groups that touch are coupled, and distributed as the particles are. Groups belong to one rank and overlap
// those of the same rank alone.
#pragma once
#include <petscksp.h>
#include "base/handle.hpp"
#include "systems/particles/condensed/aggregates.hpp"
#include "systems/particles/condensed/group_motions.hpp"
#include "systems/particles/condensed/spring_matrix.hpp"

namespace bs {

class CoarseSpace {
 public:
  /// Collective. Of the present S, with about `unknowns` coarse unknowns at most; -1: by the number of particles. `prefix`: of the
  /// options of the solver of E.
  PetscErrorCode create(SpringMatrix& S, PetscInt unknowns, const char* prefix);
  /// False where E cannot be factored or there is nothing to gain; then add() does nothing.
  bool active() const { return active_; }
  /// Whether E is solved exactly.
  bool exact() const { return exact_; }
  PetscInt unknowns() const { return unknowns_; }
  /// Collective. z += Z E^-1 Z^T r; vectors of block size d of the owned particles. `energy`: r^T Z E^-1 Z^T r, where wanted.
  PetscErrorCode add(Vec r, Vec z, PetscReal* energy = nullptr);
  PetscErrorCode view(PetscViewer viewer) const;

 private:
  PetscErrorCode choose_solver(MPI_Comm comm, const char* prefix);
  PetscErrorCode set_near_null_space(Mat E) const;
  bool active_ = false, exact_ = true;
  PetscInt unknowns_ = 0;
  Aggregates groups_;
  GroupMotions motions_;
  KSPHandle solver_;
  VecHandle in_, out_;
};

}  // namespace bs
