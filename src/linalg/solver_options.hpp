// Adjusts PETSc's solvers that options have chosen: impossible ones are refused, serial factorisations become those of every rank's block, and pivots
// are judged independently of the units of the system.
#pragma once
#include <petscpc.h>
#include <petscsys.h>

namespace bs {

/// The ordering with the least fill among those that this PETSc was built with.
#ifdef PETSC_HAVE_SUITESPARSE
constexpr char LEAST_FILL[] = MATORDERINGAMD;
#else
constexpr char LEAST_FILL[] = MATORDERINGND;
#endif

/// Collective. PETSc's LU and ILU take every pivot below 2.2e-14 for zero, whatever the size of the matrix's entries; afterwards only a pivot that is
/// zero counts as zero, unless an option -..pc_factor_zeropivot says otherwise. With `set_up` also in the blocks of bjacobi and asm, which exist once
/// PCSetUp has been called.
PetscErrorCode make_pivots_relative(PC pc, bool set_up);

/// The PC that factors: `pc` itself, or, where each rank solves the whole system (PCREDUNDANT), that of the rank's own solver.
PetscErrorCode factoring_pc(PC pc, PC* out);

/// Collective. Makes MUMPS, by which `pc` does its Cholesky factorisation, count negative pivots. It does so only where it also looks for null pivots
/// and factors its last front on one rank; both are switched on.
PetscErrorCode count_mumps_pivots(PC pc);
/// The same for `factors` by MUMPS that are yet to be computed.
PetscErrorCode count_mumps_pivots(Mat factors);

/// Whether `pc` has blocks with solvers of their own.
PetscErrorCode has_blocks(PC pc, bool* yes);

/// Collective. On several ranks -pc_type ilu (icc), which PETSc refuses there, becomes what it can only mean: bjacobi with
/// ilu (icc) on every rank's block. -pc_factor_* options go on to -sub_pc_factor_*; what the user gave as -sub_* stays. One warning
/// says so. `prefix` is the solver's, such as "condensed_". To be called before its options are read.
PetscErrorCode split_serial_factors(MPI_Comm comm, const char* prefix);

/// Collective. Ends the run with exit code 2 for nonlinear solvers that need a mesh or a user function, and for pairs of options that
/// PETSc 3.18 accepts and then crashes on.
PetscErrorCode refuse_impossible_solvers(MPI_Comm comm);

}  // namespace bs
