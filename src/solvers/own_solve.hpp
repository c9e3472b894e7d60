// A SNES whose solve is done by an object of the program.
#pragma once
#include <petsc/private/snesimpl.h>  // the solve of a SNES can be replaced, and its counts go on, by its structure alone
#include "base/attached.hpp"

namespace bs {

/// `Self` has PetscErrorCode solve(SNES), which is called in the place of SNES's own from attach_own_solve() on.
template <class Self>
PetscErrorCode own_solve(SNES snes) {
  PetscFunctionBegin;
  PetscCall(attached<Self>(snes, "bs_own_solve")->solve(snes));
  PetscFunctionReturn(0);
}

/// Collective, once for a SNES whose type is set. `self` must outlive it; `former`, if wanted, becomes the solve of the type.
template <class Self>
PetscErrorCode attach_own_solve(SNES snes, Self* self, PetscErrorCode (**former)(SNES) = nullptr) {
  PetscFunctionBegin;
  PetscCall(attach(snes, "bs_own_solve", self));
  if (former) *former = snes->ops->solve;
  snes->ops->solve = own_solve<Self>;
  PetscFunctionReturn(0);
}

}  // namespace bs
