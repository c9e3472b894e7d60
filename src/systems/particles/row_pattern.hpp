// Which blocks a particle's rows hold, of the Jacobian and of S, and how they are written into a matrix.
#pragma once
#include <petscmat.h>
#include <vector>
#include "linalg/condensed/tangent.hpp"
#include "linalg/sparse_blocks.hpp"
#include "network/network.hpp"
#include "systems/layout.hpp"

namespace bs {

/// Columns of one block row per owned particle: itself and every particle that is not fixed and to which a link couples it (has_block), ascending by
/// global index: first `low` ghosts, then `own` owned ones, then ghosts again. Rows of x hold two numbers only.
class RowPattern {
 public:
  void create(const Network& net);
  PetscInt count(PetscInt i) const { return start_[i + 1] - start_[i]; }
  /// Position of the particle's own block, and of the one that link e touches (-1: it has none).
  PetscInt self(PetscInt i) const { return self_[i]; }
  PetscInt slot(PetscInt e) const { return slot_[e]; }
  PetscInt widest() const { return widest_; }
  /// Ghost columns before the owned ones, and how many those are.
  PetscInt low(PetscInt i) const { return low_[i]; }
  PetscInt own(PetscInt i) const { return own_[i]; }
  /// Global block columns of row i, count(i) of them.
  const PetscInt* columns(PetscInt i) const { return global_.data() + start_[i]; }
  /// Blocks of this rank's rows, and what the entries of the Jacobian as AIJ take [bytes], which other types do not undercut.
  PetscInt blocks() const { return start_.back(); }
  double jacobian_bytes(int dim) const;
  bool created() const { return !start_.empty(); }
  /// Collective. A matrix with this pattern, assembled with zeros; its type is AIJ unless -mat_type says otherwise.
  PetscErrorCode create_matrix(const Network& net, Mat* out) const;
  /// The same of S, of one d x d block per entry of the pattern and the storage's type.
  double condensed_bytes(int dim, CondensedStorage storage) const;
  PetscErrorCode create_condensed(const Network& net, CondensedStorage storage, Mat* out) const;

 private:
  /// Collective. Ends the run with exit code 2 if -mat_type names a type that cannot be filled row by row, or works on one rank only.
  static PetscErrorCode check_type(MPI_Comm comm);
  PetscErrorCode preallocate(const Network& net, Mat A) const;
  PetscErrorCode write_zeros(const Network& net, Mat A) const;
  std::vector<PetscInt> start_, global_;  ///< compressed rows of global block columns
  std::vector<PetscInt> low_, own_, self_, slot_;
  PetscInt widest_ = 0;
};

/// Panel rows are -df_i/dx_j and -df_i/dv_j, side by side for every column j of a pattern: what df_i/dx_j = K and df_i/dv_j = D add to that at
/// `slot`. D null: no part by velocity.
template <int d>
inline void subtract_blocks(double* panel, PetscInt width, PetscInt slot, const double* K, const double* D) {
  for (int r = 0; r < d; ++r) {
    double *by_x = panel + r * width + Layout{d}.x(slot), *by_v = panel + r * width + Layout{d}.v(slot);
    for (int c = 0; c < d; ++c) by_x[c] -= K[r * d + c];
    if (D)
      for (int c = 0; c < d; ++c) by_v[c] -= D[r * d + c];
  }
}

/// Owned particle i's rows of a matrix as they are written, (d, count block): `panel`, in `room` with what `blocks` adds (null: nothing) and with
/// rows and columns of held components, which have `diagonal` alone (Constraints::hold_rows).
const double* complete_rows(const Network& net, const RowPattern& pattern, PetscInt i, int block, const SparseBlocks* blocks, double diagonal,
                            const double* panel, std::vector<double>* room);

/// Writes the rows of the owned particles 0, 1, 2, ..., each once, in this order. Types whose arrays PETSc gives out (AIJ; of S also BAIJ and SBAIJ
/// on one rank) are written straight into these, others through MatSetValues.
class RowWriter {
 public:
  RowWriter(const Network& net, const RowPattern& pattern) : net_(net), pattern_(pattern) {}
  PetscErrorCode begin(Mat A);
  /// What is added to the x columns of the rows written from now on; borrowed.
  void add(const SparseBlocks* blocks) { blocks_ = blocks; }
  /// Of the Jacobian: x rows scale*(sigma on x, -1 on v); v rows `panel` (d, count*2d) row-major.
  PetscErrorCode write(PetscInt i, double sigma, double scale, const double* panel);
  /// Of S: `panel` (d, count*d) row-major; `diagonal`: what held components keep there.
  PetscErrorCode write(PetscInt i, double diagonal, const double* panel);
  PetscErrorCode end();

 private:
  struct Arrays;
  static const Arrays ARRAYS[];
  void write_aij(PetscInt i, PetscInt block, const double* panel);
  void write_blocks(PetscInt i, PetscInt from, const double* panel);
  PetscErrorCode write_generic(PetscInt i, double sigma, double scale, const double* panel);
  const Network& net_;
  const RowPattern& pattern_;
  Mat matrix_ = nullptr, diagonal_ = nullptr, off_ = nullptr;
  const Arrays* arrays_ = nullptr;                                  ///< of the matrix's type; null: none are given out
  PetscScalar *diagonal_values_ = nullptr, *off_values_ = nullptr;  ///< begin of the arrays
  PetscScalar *diagonal_at_ = nullptr, *off_at_ = nullptr;          ///< where the next row goes
  const SparseBlocks* blocks_ = nullptr;
  std::vector<double> sum_;
};

}  // namespace bs
