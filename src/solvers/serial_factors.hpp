// Factorisations that PETSc has for the matrix of one rank only.
#pragma once
#include <petscsys.h>

namespace bs {

/// Collective. On several ranks -pc_type ilu (icc), which PETSc refuses there, becomes what it can only mean: bjacobi with
/// ilu (icc) on every rank's block. -pc_factor_* options go on to -sub_pc_factor_*; what the user gave as -sub_* stays. Said in
/// one warning. `prefix`: of the solver, such as "condensed_". Call before its options are read.
PetscErrorCode split_serial_factors(MPI_Comm comm, const char* prefix);

}  // namespace bs
