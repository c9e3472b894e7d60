// Signals, looked at between steps.
#pragma once

namespace bs {

/// From now on SIGTERM and SIGINT end the run after the present step, a second one of them (0.2 s later, and not the first
/// one passed on by mpirun) ends the process at once; SIGUSR1 asks for a checkpoint. These replace the previous handlers (PETSc
/// ends the program at once).
void catch_signals();

/// The signal that ends the run, on this process; 0: none.
int ending_signal();

/// Whether SIGUSR1 has come to this process since the last call.
bool take_checkpoint_signal();

}  // namespace bs
