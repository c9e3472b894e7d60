// Views of the arrays of PETSc's vectors, given back when they go out of scope.
#pragma once
#include <petscvec.h>

namespace bs {

/// This rank's numbers of a vector, as long as it lives. Where the array is lent already PETSc reports that, and the pointer is null.
template <class T, PetscErrorCode (*Get)(Vec, T**), PetscErrorCode (*Restore)(Vec, T**)>
class VecArray {
 public:
  explicit VecArray(Vec vec) : vec_(vec), lent_(Get(vec_, &numbers_) == 0) {}
  VecArray(const VecArray&) = delete;
  VecArray& operator=(const VecArray&) = delete;
  /// On ranks without numbers, too: PETSc counts changes of a vector on every rank, and norms that it keeps would be taken on some ranks alone.
  ~VecArray() {
    if (lent_) (void)Restore(vec_, &numbers_);
  }
  operator T*() const { return numbers_; }
  T* data() const { return numbers_; }

 private:
  Vec vec_;
  T* numbers_ = nullptr;
  bool lent_;
};

using ReadArray = VecArray<const PetscScalar, VecGetArrayRead, VecRestoreArrayRead>;
using WriteArray = VecArray<PetscScalar, VecGetArray, VecRestoreArray>;

}  // namespace bs
