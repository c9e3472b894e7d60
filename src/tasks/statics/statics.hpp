// The task "statics": equilibria under loads that grow in steps.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>
#include "base/facts.hpp"
#include "base/handle.hpp"
#include "systems/equilibrium.hpp"
#include "systems/model.hpp"
#include "tasks/result.hpp"
#include "tasks/run_options.hpp"
#include "tasks/statics/avalanche.hpp"
#include "time/rejections.hpp"

namespace bs {

class StaticSolver;
enum class Analyses;

/// Collective. The tasks statics and, with the stiffness of a periodic lattice at the last equilibrium (moduli.hpp), moduli, by a solver that stays.
/// As Run::advance; the trajectory has a frame and the log a row for every load step, at its load factor. `keep_input`: for models that are given
/// other numbers afterwards.
PetscErrorCode solve_statics(std::unique_ptr<Model> model, Analyses analyses, bool keep_input, StaticSolver* solver, int* exit_code);

/// The equilibrium of find_equilibrium(), or what was found on the way to it.
struct FoundEquilibrium {
  std::unique_ptr<Model> model;         ///< under the loads of `factor`
  VecHandle y;                          ///< its last equilibrium at rest (under -help the start); null: nothing was computed
  double factor = 1;                    ///< load factor of it
  std::string outcome, why;             ///< as in a report; under -help empty
  std::vector<Observable> observables;  ///< of that equilibrium
  RunCounts counts;
  Facts warnings;  ///< Warnings::save() of the way there
};

/// Collective. The equilibrium of the task statics without files. One that is not found ends in ERR_FAILED, too; `out` is filled all the same.
PetscErrorCode find_equilibrium(std::unique_ptr<Model> model, const RunOptions& options, FoundEquilibrium* out, int* exit_code);

/// Collective. The same of an equilibrium that a result of statics has, of a model that is made of the same input, without looking for it.
PetscErrorCode return_to_equilibrium(std::unique_ptr<Model> model, const SavedState& found, FoundEquilibrium* out);

// The settings of statics, and options of other tasks that it refuses.

struct StaticsSettings {
  std::int64_t steps = 1, arc_steps = 1000;
  bool arc = false;          ///< the length of a step's way is given, not its load
  double end = 1;            ///< load factor at which a path by arc length ends
  bool lower = false;        ///< it begins by lowering the load factor
  bool minima = true;        ///< saddle points of the energy are left downhill
  bool only_minima = false;  ///< the user has asked for that
  LoadRules rules;
  AvalancheOptions avalanche;
  std::int64_t stability_iterations = 50;      ///< of the search for an unstable direction; 0: none
  double box_stress_rtol = 1e-10;              ///< by which the stresses of a box are met; at most BOX_STRESS_MISSED
  std::vector<std::string> compliance_groups;  ///< whose compliance is wanted
  std::int64_t zero_modes_unknowns = 20000;    ///< up to which motions without stiffness are counted
};

/// What may be computed at the last equilibrium; moduli: beside compliances.
enum class Analyses { none, compliance, moduli };

/// Collective. Fills them from the options, those of the analyses among them; errors (exit 2) as they say.
PetscErrorCode read_statics_settings(MPI_Comm comm, Analyses analyses, StaticsSettings* out);

/// Collective. Ends the run (exit 2) where options of time stepping, or of solvers that have no meaning here, are given.
PetscErrorCode refuse_options_of_dynamics(MPI_Comm comm);

/// Collective. The same of checkpoints: the tangent and the length of a path are not kept in files.
PetscErrorCode refuse_checkpoints(MPI_Comm comm);

}  // namespace bs
