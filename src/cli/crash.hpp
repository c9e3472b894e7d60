// Signals of the process, and the last safety net: unexpected exceptions and crashes also end with one line and an exit code.
#pragma once
#include <mpi.h>
#include <petscsys.h>
#include "base/error.hpp"

namespace bs {

/// Local. From here on an uncaught exception (most often std::bad_alloc) is reported in one line and ends the
/// program with the exit code of the present phase of `comm`, on all ranks; a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) is
/// reported in one line and ends it with 128 + signal, or with Exit::input while a ReadingFile exists. `trace`: PETSc's own handler of signals,
/// which prints its traceback, stays.
PetscErrorCode install_crash_handler(MPI_Comm comm, bool trace);

/// To be called when the program ends normally. An exit() before that, by a library, is reported in one line and ends with the exit
/// code of the present phase.
void expect_exit();

/// From a signal handler: prints "backspring: error: TEXT" and ends at once. Usually all ranks arrive here: rank 0 prints first,
/// and its exit ends the others.
[[noreturn]] void end_with_line(const char* text, Exit exit);

/// Local. The work space of BLAS is taken before anything else can use the memory up. OpenBLAS maps a work space (128 MB of addresses in Debian's
/// build) at its first large call, keeps it, and asks for it again and again without end where there is no memory. So the first call is made here,
/// watched by a clock of processor time: where it does not come back, the program ends with one line and Exit::input. Call after
/// install_crash_handler() and before anything large.
PetscErrorCode reserve_blas_memory();

/// From now on SIGTERM and SIGINT end a run on `comm` after the present step (base/context.hpp), a second one of them (0.2 s later, and not the first
/// one passed on by mpirun) ends the process at once; SIGUSR1 asks for a checkpoint. These replace the previous handlers (PETSc
/// ends the program at once).
void catch_signals(MPI_Comm comm);

}  // namespace bs
