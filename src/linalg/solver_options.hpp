// PETSc's solvers as the options choose them, made fit for use: impossible ones are refused, factors of one rank become factors of every rank's
// block, pivots are judged whatever the units of the system.
#pragma once
#include <petscpc.h>
#include <petscsys.h>

namespace bs {

/// The ordering with the least fill of those that PETSc has been built with.
#ifdef PETSC_HAVE_SUITESPARSE
constexpr char LEAST_FILL[] = MATORDERINGAMD;
#else
constexpr char LEAST_FILL[] = MATORDERINGND;
#endif

/// Collective. PETSc's LU and ILU take a pivot below 2.2e-14 for zero, whatever the matrix's entries are; here only one that
/// is, unless an option -..pc_factor_zeropivot says otherwise. With `set_up`, in the blocks of bjacobi and asm,
/// too: these exist once PCSetUp has been called.
PetscErrorCode make_pivots_relative(PC pc, bool set_up);

/// The one that factors: of `pc` itself, or, where each rank solves the whole system (PCREDUNDANT), of the rank's own solver.
PetscErrorCode factoring_pc(PC pc, PC* out);

/// Collective. MUMPS, by which `pc` factors with Cholesky, counts negative pivots: only where it looks for null pivots, too, and keeps its last front
/// on one rank.
PetscErrorCode count_mumps_pivots(PC pc);
/// The same of `factors` by MUMPS that are not made yet.
PetscErrorCode count_mumps_pivots(Mat factors);

/// Whether `pc` has blocks with solvers of their own.
PetscErrorCode has_blocks(PC pc, bool* yes);

/// Collective. On several ranks -pc_type ilu (icc), which PETSc refuses there, becomes what it can only mean: bjacobi with
/// ilu (icc) on every rank's block. -pc_factor_* options go on to -sub_pc_factor_*; what the user gave as -sub_* stays. Said in
/// one warning. `prefix`: of the solver, such as "condensed_". Call before its options are read.
PetscErrorCode split_serial_factors(MPI_Comm comm, const char* prefix);

/// Collective. Ends the run with exit code 2 for nonlinear solvers that need a mesh or a user function, and for pairs of options that
/// PETSc 3.18 accepts and then crashes on.
PetscErrorCode refuse_impossible_solvers(MPI_Comm comm);

}  // namespace bs
