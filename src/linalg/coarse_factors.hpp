// The sparse matrix of a coarse grid by blocks, and its Cholesky factors, the same on every rank.
#pragma once
#include <petscsys.h>
#include <map>
#include <utility>
#include <vector>
#include "base/handle.hpp"

namespace bs {

/// A symmetric matrix by blocks between the nodes of a coarse grid: most of them are between neighbours, pairs longer than a cell make others.
class CoarseBlocks {
 public:
  /// Without values, of `nodes` nodes whose neighbours' numbers differ by `differences` (ascending, not negative); `width` numbers a block.
  void create(PetscInt nodes, std::vector<PetscInt> differences, std::size_t width);
  PetscInt nodes() const { return nodes_; }
  std::size_t width() const { return width_; }
  /// The numbers of block (a, b), a <= b; zero at first.
  double* at(PetscInt a, PetscInt b) {
    const std::size_t apart = static_cast<std::size_t>(b - a);
    if (apart >= slot_.size() || slot_[apart] < 0) return far(a, b);
    return near_.data() + (static_cast<std::size_t>(a) * difference_.size() + static_cast<std::size_t>(slot_[apart])) * width_;
  }
  /// Collective. Replaces the numbers by their sums over the ranks.
  PetscErrorCode sum(MPI_Comm comm);
  /// visit(a, b, numbers) of every block that is not zero.
  template <class Visit>
  void for_each(Visit visit) const {
    for (PetscInt a = 0; a < nodes_; ++a)
      for (std::size_t k = 0; k < difference_.size(); ++k) {
        const double* numbers = near_.data() + (static_cast<std::size_t>(a) * difference_.size() + k) * width_;
        if (a + difference_[k] < nodes_ && !zero(numbers)) visit(a, a + difference_[k], numbers);
      }
    for (const auto& [ends, numbers] : far_)
      if (!zero(numbers.data())) visit(ends.first, ends.second, numbers.data());
  }

 private:
  double* far(PetscInt a, PetscInt b);
  bool zero(const double* numbers) const {
    for (std::size_t k = 0; k < width_; ++k)
      if (numbers[k] != 0) return false;
    return true;
  }
  PetscErrorCode sum_far(MPI_Comm comm);
  PetscInt nodes_ = 0;
  std::size_t width_ = 0;
  std::vector<PetscInt> difference_, slot_;  ///< of neighbours; the place of a difference among these, -1: none
  std::vector<double> near_;                 ///< (nodes, differences, width)
  std::map<std::pair<PetscInt, PetscInt>, std::vector<double>> far_;
};

class CoarseFactors {
 public:
  /// Local. Of E = blocks + full. `blocks`: symmetric, the rows of their upper triangles (d (d+1)/2 numbers); `full`: d x d, row-major,
  /// what is not symmetric block by block, of points held in part and of R; empty where there is none. Unknowns without entries get 1 on the
  /// diagonal. `definite`: whether E is positive definite; else there are no factors.
  PetscErrorCode create(int d, const CoarseBlocks& blocks, const CoarseBlocks& full, bool* definite);
  /// Local. out = E^-1 in.
  PetscErrorCode solve(const double* in, double* out);

 private:
  PetscErrorCode set_pattern(int d, const CoarseBlocks& blocks, const CoarseBlocks& full);
  PetscErrorCode set_values(int d, const CoarseBlocks& blocks, const CoarseBlocks& full);
  PetscErrorCode factor(bool* definite);
  std::vector<std::pair<PetscInt, PetscInt>> pattern_;  ///< blocks of E
  MatHandle E_;
  PCHandle factors_;
  VecHandle in_, out_;
};

}  // namespace bs
