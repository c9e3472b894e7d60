// The last safety net: unexpected exceptions and crashes also end with one line and an exit code.
#pragma once
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

}  // namespace bs
