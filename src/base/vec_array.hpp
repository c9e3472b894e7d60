// Views of the arrays of PETSc's vectors, given back when they go out of scope.
#pragma once
#include <petscvec.h>

namespace bs {

/// This rank's numbers of a vector, as long as it lives. Where the array is lent already PETSc reports that, and the pointer is null.
template <class T, PetscErrorCode (*Get)(Vec, T**), PetscErrorCode (*Restore)(Vec, T**)>
class VecArray {
 public:
  explicit VecArray(Vec vec) : vec_(vec) { (void)Get(vec_, &numbers_); }
  VecArray(const VecArray&) = delete;
  VecArray& operator=(const VecArray&) = delete;
  ~VecArray() {
    if (numbers_) (void)Restore(vec_, &numbers_);
  }
  operator T*() const { return numbers_; }
  T* data() const { return numbers_; }

 private:
  Vec vec_;
  T* numbers_ = nullptr;
};

using ReadArray = VecArray<const PetscScalar, VecGetArrayRead, VecRestoreArrayRead>;
using WriteArray = VecArray<PetscScalar, VecGetArray, VecRestoreArray>;

}  // namespace bs
