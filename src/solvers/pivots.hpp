// Factorisations that do not depend on the units the system is written in.
#pragma once
#include <petscpc.h>

namespace bs {

/// Collective. PETSc's LU and ILU take a pivot below 2.2e-14 for zero, whatever the matrix's entries are; here only one that
/// is, unless an option -..pc_factor_zeropivot says otherwise. With `set_up`, in the blocks of bjacobi and asm,
/// too: these exist once PCSetUp has been called.
PetscErrorCode make_pivots_relative(PC pc, bool set_up);

/// Whether `pc` has blocks with solvers of their own.
PetscErrorCode has_blocks(PC pc, bool* yes);

}  // namespace bs
