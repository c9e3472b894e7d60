// How the program reports errors, and its exit codes.
#pragma once
#include <petscsys.h>
#include <string>
#include "base/error.hpp"

namespace bs {

/// "backspring: KIND: TEXT" on stderr as one line, control characters blanked.
void print_line(const char* kind, const std::string& text);

/// Local. From here on errors and warnings of `comm` are printed at once, on one rank. An error of one rank alone ends the others, where there are
/// any: rank 0 prints at once, another rank after waiting one second, then MPI_Abort with the error's exit code.
void print_messages_of(MPI_Comm comm);

/// Local. PETSc's errors are reported with PETSc's own traceback (-bs_trace), until PetscPopErrorHandler.
PetscErrorCode trace_petsc_errors(MPI_Comm comm);

/// The exit code of a run on `comm` that ended with `code`: 0, that of the error attached to `comm`, or, for an error of PETSc's, that of the present
/// phase (on several ranks this ends in MPI_Abort here, if it has not yet). Functions whose name begins with "main" must not use PetscCall: PETSc
/// aborts there with the bare error code. Write: return exit_code_of(comm, run(...)).
int exit_code_of(MPI_Comm comm, PetscErrorCode code);

}  // namespace bs
