// Direct solvers: one with pivoting, and a test for singular matrices.
#pragma once
#include <petscksp.h>
#include <string>

namespace bs {

/// Collective. `ksp` solves with `A` by one sparse LU with pivoting (MUMPS), options with `prefix`; set up on return.
PetscErrorCode create_direct(MPI_Comm comm, Mat A, const char* prefix, KSP* ksp);

/// Collective. Whether the direct solver of `ksp`, which is set up, has failed, or returns a known solution with not one
/// right digit in units in which A's columns have size 1: then A is singular to working precision. False for others.
PetscErrorCode is_singular(KSP ksp, bool* singular);

/// Collective. What a solver that takes its preconditioner for the inverse (preonly, none direct) leaves of a right side; 0 for others,
/// whose own test of convergence judges them.
PetscErrorCode trial_residual(KSP ksp, double* left);

/// Collective. The same as one line of error, empty if it solves. `prefix` of its options.
PetscErrorCode refusal_of(KSP ksp, const char* prefix, std::string* text);

}  // namespace bs
