// The task "statics": equilibria under loads that grow in steps.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <memory>
#include <string>
#include "base/handle.hpp"
#include "systems/equilibrium.hpp"
#include "systems/model.hpp"
#include "tasks/result.hpp"
#include "tasks/run_options.hpp"

namespace bs {

/// Collective. As run_model; the trajectory has a frame and the log a row for every load step, at its load factor.
/// `result`: unless null, the last equilibrium.
PetscErrorCode run_statics(std::unique_ptr<Model> model, Result* result, int* exit_code);

/// Collective. The same, and at the last equilibrium the stiffness of a periodic lattice (moduli.hpp).
PetscErrorCode run_moduli(std::unique_ptr<Model> model, Result* result, int* exit_code);

/// The equilibrium of `settle`, or what was found on the way to it.
struct Settled {
  std::unique_ptr<Model> model;  ///< under the loads of `factor`
  VecHandle y;                   ///< its last equilibrium at rest (under -help the start); null: nothing was computed
  double factor = 1;             ///< load factor of it
  std::string outcome, why;      ///< as in a report; under -help empty
};

/// Collective. The same as run_statics without files. As with run_statics, an equilibrium that is not found ends in ERR_FAILED; `out` is filled all
/// the same.
PetscErrorCode settle(std::unique_ptr<Model> model, const RunOptions& options, Settled* out, int* exit_code);

// The options of -bs_task statics, and those of other tasks that it refuses.

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
