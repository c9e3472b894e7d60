// Blocks of a matrix that do not come from pairs of points alone: those of interactions of several ends.
#pragma once
#include <petscsys.h>
#include <vector>

namespace bs {

/// Compressed rows of d x d blocks, row-major: rows are owned points, columns local ones (owned, then ghosts), ascending.
class SparseBlocks {
 public:
  /// Joins (row, column) of a matrix of n block rows; any order, repeats allowed. Values are zero.
  void create(PetscInt n, int d, const std::vector<std::pair<PetscInt, PetscInt>>& joins);
  bool created() const { return !start_.empty(); }
  PetscInt count(PetscInt i) const { return start_[i + 1] - start_[i]; }
  /// Place of block (i, j), which must be there.
  PetscInt find(PetscInt i, PetscInt j) const;
  /// visit(j, block) for the blocks of row i, ascending by column.
  template <class Visit>
  void for_row(PetscInt i, Visit visit) const {
    for (PetscInt k = start_[i]; k < start_[i + 1]; ++k) visit(column_[k], value_.data() + static_cast<std::size_t>(k) * area_);
  }
  double* block(PetscInt place) { return value_.data() + static_cast<std::size_t>(place) * area_; }
  void zero();
  /// Multiplies row i of blocks by scale[i].
  void scale_rows(const std::vector<double>& scale);
  /// y += A p; `owned` (n, d) and `ghosts` of p.
  void multiply_add(const double* owned, const double* ghosts, double* y) const;
  /// Adds the diagonal blocks to `blocks` (n, d, d).
  void add_diagonal(std::vector<double>* blocks) const;
  /// Adds row i to a panel (d, count `stride`) of blocks, `stride` numbers wide each. columns: their global indices, ascending, `count` of
  /// them; global: of local columns.
  void add_to_panel(PetscInt i, const std::vector<PetscInt>& global, const PetscInt* columns, PetscInt count, PetscInt stride, double* panel) const;

 private:
  template <int d>
  void multiply(const double* owned, const double* ghosts, double* y) const;
  PetscInt n_ = 0;
  std::size_t d_ = 3, area_ = 9;
  std::vector<PetscInt> start_, column_;
  std::vector<double> value_;
};

}  // namespace bs
