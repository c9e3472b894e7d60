// Owners of PETSc objects: destroyed when they go out of scope, moved but never copied.
#pragma once
#include <petscsf.h>
#include <petscts.h>
#include <utility>

namespace bs {

/// Owns one PETSc object of type T, released by Destroy. `out()` hands its address to a creating call.
template <class T, PetscErrorCode (*Destroy)(T*)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(T object) : object_(object) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  ~Handle() { reset(); }

  /// Releases what is held; errors on the way out cannot be handled and are dropped.
  void reset() {
    if (object_) (void)Destroy(&object_);
    object_ = nullptr;
  }
  T* out() {
    reset();
    return &object_;
  }
  T get() const { return object_; }
  operator T() const { return object_; }
  explicit operator bool() const { return object_ != nullptr; }

 private:
  T object_ = nullptr;
};

using VecHandle = Handle<Vec, VecDestroy>;
using MatHandle = Handle<Mat, MatDestroy>;
using ISHandle = Handle<IS, ISDestroy>;
using ScatterHandle = Handle<VecScatter, VecScatterDestroy>;
using SFHandle = Handle<PetscSF, PetscSFDestroy>;
using LayoutHandle = Handle<PetscLayout, PetscLayoutDestroy>;
using KSPHandle = Handle<KSP, KSPDestroy>;
using PCHandle = Handle<PC, PCDestroy>;
using SNESHandle = Handle<SNES, SNESDestroy>;
using TSHandle = Handle<TS, TSDestroy>;
using ViewerHandle = Handle<PetscViewer, PetscViewerDestroy>;

/// `copy` gets the numbers of `original`, in the vector that it has, or else in one made like that.
inline PetscErrorCode copy_into(VecHandle* copy, Vec original) {
  PetscFunctionBegin;
  if (!*copy) PetscCall(VecDuplicate(original, copy->out()));
  PetscCall(VecCopy(original, *copy));
  PetscFunctionReturn(0);
}

/// Collective. The matrix is ready for use, all its entries set.
inline PetscErrorCode assemble(Mat A) {
  PetscFunctionBegin;
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

}  // namespace bs
