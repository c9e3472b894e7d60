// The options of -bs_task statics, and those of other tasks that it refuses.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include "systems/equilibrium.hpp"

namespace bs {

struct LoadOptions {
  std::int64_t steps = 1, arc_steps = 1000;
  bool arc = false;    ///< the length of a step's way is given, not its load
  double end = 1;      ///< load factor at which a path by arc length ends
  bool lower = false;  ///< it begins by lowering the load factor
  LoadRules rules;
};

/// Collective. Reads them; errors (exit 2) as they say.
PetscErrorCode read_load_options(MPI_Comm comm, LoadOptions* out);

/// Collective. Ends the run (exit 2) where options of time stepping, or of solvers that have no meaning here, are given.
PetscErrorCode refuse_options_of_dynamics(MPI_Comm comm);

/// Collective. The same of checkpoints: the tangent and the length of a path are not kept in files.
PetscErrorCode refuse_checkpoints(MPI_Comm comm);

}  // namespace bs
