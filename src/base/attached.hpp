// Objects of the program that hang on PETSc's, by name.
#pragma once
#include <petscsys.h>

namespace bs {

/// Collective. attached() finds `pointer` on `object` under that name, in place of one before; what it points to must outlive its use.
template <class Object>
PetscErrorCode attach(Object object, const char* name, void* pointer) {
  PetscObject to = reinterpret_cast<PetscObject>(object);
  PetscContainer holder;
  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm(to), &holder));
  PetscCall(PetscContainerSetPointer(holder, pointer));
  PetscCall(PetscObjectCompose(to, name, reinterpret_cast<PetscObject>(holder)));
  PetscCall(PetscContainerDestroy(&holder));
  PetscFunctionReturn(0);
}

/// Null where nothing hangs on it under that name.
template <class T, class Object>
T* attached(Object object, const char* name) {
  PetscObject holder = nullptr;
  void* pointer = nullptr;
  if (PetscObjectQuery(reinterpret_cast<PetscObject>(object), name, &holder) || !holder) return nullptr;
  return PetscContainerGetPointer(reinterpret_cast<PetscContainer>(holder), &pointer) ? nullptr : static_cast<T*>(pointer);
}

}  // namespace bs
