// The free vibrations -K q = omega^2 M q of a linearised system as a standard symmetric problem,
//   A u = omega^2 u,   A = M^-1/2 (-K) M^-1/2,   u = M^1/2 q,
// over the components that can move: held ones have no row. u of length 1 is q with q.M q = 1.
#pragma once
#include <petscksp.h>
#include <vector>
#include "base/handle.hpp"
#include "linalg/pencil.hpp"

namespace bs {

class StandardForm {
 public:
  /// Collective. `linearised`, which must outlive the object, is linearised at the state of interest already.
  PetscErrorCode create(Pencil& linearised);
  MPI_Comm comm() const { return lin_->comm(); }
  Pencil& linearised() const { return *lin_; }
  /// Rows of A, of all ranks.
  PetscInt unknowns() const { return total_; }
  /// Collective. A vector u; or one over all components, blocks of d.
  PetscErrorCode create_vector(Vec* u) const;
  PetscErrorCode create_full(Vec* z) const;
  /// q = M^-1/2 u, zero at held components.
  PetscErrorCode shape(Vec u, Vec q) const;
  /// u = M^1/2 q of the components that can move.
  PetscErrorCode weigh(Vec q, Vec u) const;
  /// Collective. v = A u exactly, without a matrix.
  PetscErrorCode multiply(Vec u, Vec v);
  /// Collective. A MATSHELL that multiplies by A, K being stored by symmetric blocks.
  PetscErrorCode create_operator(Mat* A);
  /// Collective. v = A u by the stored K.
  PetscErrorCode multiply_stored(Vec u, Vec v);
  /// Collective. A as an AIJ matrix.
  PetscErrorCode assemble(Mat* A) const;
  /// Collective. The diagonal of A, and the approximate inverse of its definite part plus `shift` by block factors and a
  /// coarse grid, as a PC without matrix.
  PetscErrorCode create_preconditioner(double shift, PC pc);
  PetscErrorCode diagonal(Vec out);
  /// s: the stiffness of all that acts on a component's point, whatever its direction, by the mass. Rounding errors of u.A u are eps u.s u.
  PetscErrorCode sizes(Vec s) const;
  /// Frees the matrices behind the operator and the preconditioner, which are of no use afterwards.
  void release_matrices();

 private:
  friend PetscErrorCode apply_inverse(PC pc, Vec r, Vec z);
  PetscErrorCode create_springs();
  PetscErrorCode weigh_force(Vec v) const;
  Pencil* lin_ = nullptr;
  std::vector<PetscInt> at_;  ///< place of component k among this rank's n d
  std::vector<double> root_;  ///< sqrt(m) of component k
  PetscInt total_ = 0;
  VecHandle full_, other_;
  MatHandle springs_, stored_;
  PCHandle inverse_;
};

/// Collective. Orthonormal u = M^1/2 q of those translations and rotations q, and their sums, with K q = 0 at the state that
/// `form` is linearised at: at most 1, 3 or 6 in one, two or three dimensions; less where points are held or on a line. `sizes`: of A
/// (StandardForm::sizes).
PetscErrorCode rigid_motions(StandardForm& form, Vec sizes, std::vector<VecHandle>* u);

}  // namespace bs
