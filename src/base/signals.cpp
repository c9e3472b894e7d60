#include "base/signals.hpp"
#include "base/context.hpp"

namespace bs {

void set_signals(MPI_Comm comm, Signals signals) { held_by<Signals>(comm) = std::move(signals); }

int ending_signal(MPI_Comm comm) {
  const Signals& signals = held_by<Signals>(comm);
  return signals.ending ? signals.ending() : 0;
}

bool checkpoint_is_asked(MPI_Comm comm) {
  const Signals& signals = held_by<Signals>(comm);
  return signals.checkpoint && signals.checkpoint();
}

}  // namespace bs
