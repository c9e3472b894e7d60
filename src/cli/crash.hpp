// Signal handlers, and the last resort for unexpected exceptions and crashes, which also end with one line and an exit code.
#pragma once
#include <mpi.h>
#include <petscsys.h>
#include "base/error.hpp"

namespace bs {

/// Local. From here on an uncaught exception (most often std::bad_alloc) is reported in one line and ends the
/// program with the exit code of the present phase of `comm`, on all ranks; a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) is
/// reported in one line and ends it with 128 + signal, or with Exit::input while a ReadingFile exists. `trace`: keeps PETSc's own signal handler,
/// which prints its traceback.
PetscErrorCode install_crash_handler(MPI_Comm comm, bool trace);

/// To be called when the program ends normally. An exit() before that, by a library, is reported in one line and ends with the exit
/// code of the present phase.
void expect_exit();

/// From a signal handler: prints "backspring: error: TEXT" and ends at once. Usually all ranks arrive here: rank 0 prints first,
/// and its exit ends the others.
[[noreturn]] void end_with_line(const char* text, Exit exit);

/// Local. Makes BLAS allocate its work space before anything else can use up the memory. OpenBLAS maps a work space (128 MB of addresses in Debian's
/// build) at its first large call and keeps it; where there is no memory it tries again for ever. So the first such call is made here, limited by a
/// timer of processor time: if it does not return, the program ends with one line and Exit::input. To be called after install_crash_handler() and
/// before any large allocation.
PetscErrorCode reserve_blas_memory();

/// From now on SIGTERM and SIGINT end a run on `comm` after the present step (base/context.hpp), a second one of them (0.2 s later, and not the first
/// one passed on by mpirun) ends the process at once; SIGUSR1 asks for a checkpoint. These replace the previous handlers (PETSc
/// ends the program at once).
void catch_signals(MPI_Comm comm);

}  // namespace bs
