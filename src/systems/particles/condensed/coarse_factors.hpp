// Cholesky factors of the sparse matrix of a coarse grid, the same on every rank.
#pragma once
#include <utility>
#include <vector>
#include "base/handle.hpp"
#include "systems/particles/condensed/coarse_blocks.hpp"

namespace bs {

class CoarseFactors {
 public:
  /// Local. Of E = blocks + rolling. `blocks`: symmetric, the rows of their upper triangles (d (d+1)/2 numbers); `rolling`: d x d, row-major,
  /// empty where there are no rollers. Unknowns without entries get 1 on the diagonal. `definite`: whether E is positive definite; else
  /// there are no factors.
  PetscErrorCode create(int d, const CoarseBlocks& blocks, const CoarseBlocks& rolling, bool* definite);
  /// Local. out = E^-1 in.
  PetscErrorCode solve(const double* in, double* out);

 private:
  PetscErrorCode set_pattern(int d, const CoarseBlocks& blocks, const CoarseBlocks& rolling);
  PetscErrorCode set_values(int d, const CoarseBlocks& blocks, const CoarseBlocks& rolling);
  PetscErrorCode factor(bool* definite);
  std::vector<std::pair<PetscInt, PetscInt>> pattern_;  ///< blocks of E
  MatHandle E_;
  PCHandle factors_;
  VecHandle in_, out_;
};

}  // namespace bs
