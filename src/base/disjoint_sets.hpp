// Disjoint sets of numbers, joined one by one.
#pragma once
#include <petscsys.h>
#include <numeric>
#include <utility>
#include <vector>

namespace bs {

/// Sets of 0 .. n - 1, at first of one member each.
class DisjointSets {
 public:
  explicit DisjointSets(PetscInt n) : above_(static_cast<std::size_t>(n)), size_(static_cast<std::size_t>(n), 1) {
    std::iota(above_.begin(), above_.end(), 0);
  }
  /// A member of i's set, the same for all its members.
  PetscInt top(PetscInt i) {
    while (above_[i] != i) i = above_[i] = above_[above_[i]];
    return i;
  }
  void join(PetscInt i, PetscInt j) {
    i = top(i);
    j = top(j);
    if (i == j) return;
    if (size_[i] < size_[j]) std::swap(i, j);
    above_[j] = i;
    size_[i] += size_[j];
  }
  /// Members of i's set.
  PetscInt size(PetscInt i) { return size_[top(i)]; }

 private:
  std::vector<PetscInt> above_, size_;
};

}  // namespace bs
