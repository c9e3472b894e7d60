// A SNES whose solve is done by an object of the program.
#pragma once
#include <petsc/private/snesimpl.h>  // the solve of a SNES can be replaced, and its counts go on, by its structure alone

namespace bs {

/// `Self` has PetscErrorCode solve(SNES), which is called in the place of SNES's own from attach_own_solve() on.
template <class Self>
PetscErrorCode own_solve(SNES snes) {
  PetscContainer holder = nullptr;
  void* self = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscObjectQuery(reinterpret_cast<PetscObject>(snes), "bs_own_solve", reinterpret_cast<PetscObject*>(&holder)));
  PetscCall(PetscContainerGetPointer(holder, &self));
  PetscCall(static_cast<Self*>(self)->solve(snes));
  PetscFunctionReturn(0);
}

/// Collective, once for a SNES whose type is set. `self` must outlive it; `former`, if wanted, becomes the solve of the type.
template <class Self>
PetscErrorCode attach_own_solve(SNES snes, Self* self, PetscErrorCode (**former)(SNES) = nullptr) {
  PetscContainer holder;
  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm(reinterpret_cast<PetscObject>(snes)), &holder));
  PetscCall(PetscContainerSetPointer(holder, self));
  PetscCall(PetscObjectCompose(reinterpret_cast<PetscObject>(snes), "bs_own_solve", reinterpret_cast<PetscObject>(holder)));
  PetscCall(PetscContainerDestroy(&holder));
  if (former) *former = snes->ops->solve;
  snes->ops->solve = own_solve<Self>;
  PetscFunctionReturn(0);
}

}  // namespace bs
