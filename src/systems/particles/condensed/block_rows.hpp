// S as a PETSc matrix of d x d blocks (AIJ, BAIJ, SBAIJ), written row by row straight into its arrays.
#pragma once
#include <petscmat.h>
#include <vector>
#include "linalg/condensed/tangent.hpp"
#include "systems/particles/row_pattern.hpp"

namespace bs {

/// What the entries of such a matrix take on this rank [bytes].
double block_matrix_bytes(const Network& net, const RowPattern& pattern, CondensedStorage storage);

/// Collective. An assembled matrix of zeros with one d x d block per entry of the pattern. Its type is the storage's.
PetscErrorCode create_block_matrix(const Network& net, const RowPattern& pattern, CondensedStorage storage, Mat* out);

/// Writes block rows 0, 1, 2, ... of the owned particles, each once, in this order. Types whose arrays PETSc keeps to
/// itself (parallel SBAIJ) go through MatSetValuesBlocked.
class BlockRowWriter {
 public:
  BlockRowWriter(const Network& net, const RowPattern& pattern) : net_(net), pattern_(pattern) {}
  PetscErrorCode begin(Mat S);
  /// What is added to the rows written from now on; borrowed.
  void add(const SparseBlocks* blocks) { blocks_ = blocks; }
  /// a of a M - b D - c K: what held components keep on the diagonal.
  void set_inertia(double a) { inertia_ = a; }
  /// `panel`: (d, count d) row-major, the blocks of row i side by side in the pattern's order.
  PetscErrorCode write(PetscInt i, const double* panel);
  PetscErrorCode end();

 private:
  enum class Way { aij, baij, sbaij, generic };
  void write_aij(PetscInt i, const double* panel);
  void write_blocks(PetscInt i, PetscInt from, const double* panel);
  PetscErrorCode write_generic(PetscInt i, const double* panel);
  const Network& net_;
  const RowPattern& pattern_;
  Way way_ = Way::generic;
  Mat matrix_ = nullptr, diagonal_ = nullptr, off_ = nullptr;
  PetscScalar *diagonal_values_ = nullptr, *off_values_ = nullptr;  ///< begin of the arrays
  PetscScalar *diagonal_at_ = nullptr, *off_at_ = nullptr;          ///< where the next row goes
  const SparseBlocks* blocks_ = nullptr;
  std::vector<double> sum_;
  double inertia_ = 0;
};

}  // namespace bs
