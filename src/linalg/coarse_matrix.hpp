// The sparse symmetric matrix E of a coarse space by blocks, and its factors, the same on every rank.
#pragma once
#include <petscsys.h>
#include <vector>
#include "base/handle.hpp"

namespace bs {

class CoarseMatrix {
 public:
  /// Zero, of `nodes` nodes with `width` unknowns each; rows of blocks take `stride` numbers.
  void create(PetscInt nodes, int width, int stride);
  PetscInt unknowns() const { return static_cast<PetscInt>(rows_.size()) * width_; }
  /// Where block (a, b), a <= b, begins; the place stays as more blocks come, their numbers may move.
  std::size_t place(PetscInt a, PetscInt b);
  double* numbers(std::size_t place) { return numbers_.data() + place; }
  /// Collective. The numbers become their sums over the ranks, in their order; then E is factored by every rank: by CHOLMOD where it is positive
  /// definite, else as L D L^T. Unknowns without entries have 1 on the diagonal. factored: false where that failed, too.
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
  std::vector<PetscInt> pattern_;  ///< columns of all rows, each row ended by -1
  MatHandle E_;
  PCHandle factors_;
  const char* package_ = nullptr;  ///< of factors_
  VecHandle in_, out_;
};

}  // namespace bs
