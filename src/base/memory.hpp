// What is about to be allocated is checked against what may be had, before libraries run out of memory halfway.
#pragma once
#include <petscsys.h>

#include <string>

namespace bs {

struct MemoryNeed {
  std::string what;    ///< subject of "... needs at least 9.8 GB of memory"
  double bytes = 0;    ///< on this rank: a lower bound of what is new and held at one time, so that no run is refused that would end well
  std::string advice;  ///< what else than more memory or ranks helps, "give -pc_type jacobi", or empty
};

/// Collective. Told, with the exit code of the present phase, where some rank cannot have its part: a limit on the process
/// (ulimit -v, -d), a control group or the machine leaves less to the ranks on it, or the system refuses a mapping of that
/// size, made and undone here. Under 4 MB on every rank nothing is looked at.
PetscErrorCode reserve_memory(MPI_Comm comm, const MemoryNeed& need);

/// Collective. Reads -bs_memory_check, without which reserve_memory checks.
PetscErrorCode read_memory_option(MPI_Comm comm);

}  // namespace bs
