// The sparse symmetric matrix E of a coarse space, stored by blocks, and its factors; both are the same on every rank.
#pragma once
#include <petscsys.h>
#include <vector>
#include "base/handle.hpp"

namespace bs {

class CoarseMatrix {
 public:
  /// Makes E a zero matrix of `nodes` nodes with `width` unknowns each; a row of a block takes `stride` numbers.
  void create(PetscInt nodes, int width, int stride);
  PetscInt unknowns() const { return static_cast<PetscInt>(rows_.size()) * width_; }
  /// Index at which the numbers of block (a, b), a <= b, begin; adds the block where there is none. The index stays valid when blocks are added,
  /// pointers from numbers() do not.
  std::size_t place(PetscInt a, PetscInt b);
  double* numbers(std::size_t place) { return numbers_.data() + place; }
  /// Collective. Sums the numbers over the ranks, in the order of the ranks; then every rank factors E: by CHOLMOD where it is positive definite,
  /// else as L D L^T. Unknowns without entries get 1 on the diagonal. `factored` is false where L D L^T failed as well.
  PetscErrorCode factor(MPI_Comm comm, bool* definite, bool* factored);
  /// Local. out = E^-1 in.
  PetscErrorCode solve(const double* in, double* out);

 private:
  struct Entry {
    PetscInt column;
    std::size_t place;
  };
  PetscErrorCode sum(MPI_Comm comm);
  PetscErrorCode set_pattern();
  PetscErrorCode set_values();
  PetscErrorCode set_up(const char* package, bool* done);
  int width_ = 3, stride_ = 3;
  std::vector<std::vector<Entry>> rows_;
  std::vector<double> numbers_;
  std::vector<PetscInt> pattern_;  ///< columns of all rows; -1 ends each row
  MatHandle E_;
  PCHandle factors_;
  const char* package_ = nullptr;  ///< the package that factors_ uses
  VecHandle in_, out_;
};

}  // namespace bs
