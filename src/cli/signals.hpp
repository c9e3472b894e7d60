// Signals of the process.
#pragma once
#include <mpi.h>

namespace bs {

/// From now on SIGTERM and SIGINT end a run on `comm` after the present step (base/signals.hpp), a second one of them (0.2 s later, and not the first
/// one passed on by mpirun) ends the process at once; SIGUSR1 asks for a checkpoint. These replace the previous handlers (PETSc
/// ends the program at once).
void catch_signals(MPI_Comm comm);

}  // namespace bs
