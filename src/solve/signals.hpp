// Signals, looked at between steps.
#pragma once

namespace bs {

/// From now on SIGTERM and SIGINT end the run after the present step, SIGUSR1 asks for a checkpoint; taken over from
/// whoever had them (PETSc ends the program at once).
void catch_signals();

/// The signal that ends the run, on this process; 0: none.
int ending_signal();

/// Whether SIGUSR1 has come to this process since the last call.
bool take_checkpoint_signal();

}  // namespace bs
