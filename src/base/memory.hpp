// A check of the memory that is about to be allocated against what is available, before libraries run out of memory halfway.
#pragma once
#include <petscsys.h>

#include <string>

namespace bs {

struct MemoryNeed {
  std::string what;    ///< subject of "... needs at least 9.8 GB of memory"
  double bytes = 0;    ///< on this rank: a lower bound of what is new and held at one time, so that no run is refused that would succeed
  std::string advice;  ///< what else than more memory or ranks helps, "give -pc_type jacobi", or empty
};

/// Collective. Ends the run, with the exit code of the present phase, if some rank cannot get its share: a limit on the process
/// (ulimit -v, -d), a control group or the machine leaves less to the ranks on it, or the system refuses a mapping of that
/// size, made and undone here. Requests below 4 MB on every rank are not checked.
PetscErrorCode reserve_memory(MPI_Comm comm, const MemoryNeed& need);

/// Collective. Reads -bs_memory_check, without which reserve_memory checks.
PetscErrorCode read_memory_option(MPI_Comm comm);

}  // namespace bs
