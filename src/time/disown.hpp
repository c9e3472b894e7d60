// Solvers that outlive the run that they compute for.
#pragma once
#include <petscts.h>

namespace bs {

/// Collective, when what `ts` computes with is about to end. The stepper, its nonlinear and linear solvers and their matrices compute no more, where
/// others refer to them: steps, solves and products are PETSc's errors that say so, and what is only looked at stays.
PetscErrorCode disown(TS ts);

/// `tell` says so in the place of PETSc, and returns the code of an error.
void tell_of_refusals(PetscErrorCode (*tell)(const char* text));

}  // namespace bs
