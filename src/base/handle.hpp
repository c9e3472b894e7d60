// Owners of PETSc objects: destroyed when they go out of scope, moved but never copied.
#pragma once
#include <petscsf.h>
#include <petscts.h>
#include <utility>
#include <vector>

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

/// Collective. A vector of `rows` rows of this rank, of `width` numbers each.
inline PetscErrorCode create_vec(MPI_Comm comm, PetscInt rows, PetscInt width, Vec* out) {
  PetscFunctionBegin;
  PetscCall(VecCreate(comm, out));
  PetscCall(VecSetSizes(*out, rows * width, PETSC_DETERMINE));
  PetscCall(VecSetBlockSize(*out, width));
  PetscCall(VecSetType(*out, VECSTANDARD));
  PetscFunctionReturn(0);
}

/// Collective. `to` gets what the scatter takes from `from`; the other way round adds to it.
inline PetscErrorCode scatter_all(VecScatter scatter, Vec from, Vec to, ScatterMode way = SCATTER_FORWARD, InsertMode mode = INSERT_VALUES) {
  PetscFunctionBegin;
  PetscCall(VecScatterBegin(scatter, from, to, mode, way));
  PetscCall(VecScatterEnd(scatter, from, to, mode, way));
  PetscFunctionReturn(0);
}

/// Collective. Every leaf of `to` gets the `width` numbers of its root in `from`.
template <class T>
PetscErrorCode fetch_roots(PetscSF sf, int width, const std::vector<T>& from, std::vector<T>* to) {
  MPI_Datatype type;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Type_contiguous(width * static_cast<int>(sizeof(T)), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(PetscSFBcastBegin(sf, type, from.data(), to->data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, type, from.data(), to->data(), MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(0);
}

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
