// What the owner of a communicator asks of a run on it, looked at between steps.
#pragma once
#include <mpi.h>
#include <functional>
#include <utility>
#include "base/context.hpp"

namespace bs {

/// By default nothing is asked. Each rank has its own; what one of them is asked, all do.
struct Signals {
  std::function<int()> ending;       ///< the number of the signal that ends the run; 0: none
  std::function<bool()> checkpoint;  ///< whether a checkpoint was asked for since the last call
};
inline void set_signals(MPI_Comm comm, Signals signals) { held_by<Signals>(comm) = std::move(signals); }

/// Local.
inline int ending_signal(MPI_Comm comm) {
  const Signals& signals = held_by<Signals>(comm);
  return signals.ending ? signals.ending() : 0;
}
inline bool checkpoint_is_asked(MPI_Comm comm) {
  const Signals& signals = held_by<Signals>(comm);
  return signals.checkpoint && signals.checkpoint();
}

}  // namespace bs
