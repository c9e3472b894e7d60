// Equilibria under loads that grow in steps, by a run that stays.
#pragma once
#include <memory>
#include "tasks/statics/static_run.hpp"

namespace bs {

/// The tasks that look for equilibria make one and let it go. A session keeps it: from the last equilibrium on it follows what changed numbers of the
/// system make of it, with the pattern, the partition and the solvers at hand.
class StaticSolver {
 public:
  StaticSolver() = default;
  StaticSolver(const StaticSolver&) = delete;
  StaticSolver& operator=(const StaticSolver&) = delete;
  /// Collective. Takes the mechanics of `model`. Errors (exit 2): what has no equilibria; loads on what nothing holds.
  PetscErrorCode create(std::unique_ptr<Model> model, const StaticsSettings& loads, const RunOptions& options);
  /// Collective. What of them is to be computed at the last equilibrium, for the task that is the whole run; before run().
  PetscErrorCode analyse(bool moduli);
  /// Collective. All load steps, as Run::advance; what was found on the way is there all the same where the run failed.
  PetscErrorCode run(int* exit_code);
  /// Collective, after a run that went well, without files. From the last equilibrium to the one of the system as it is now (Mechanics::set_numbers).
  /// Error (exit 3): there is none, and the last one stays; a path by arc length cannot be followed (exit 2).
  PetscErrorCode follow();
  /// Collective, after run() or follow() went well. For a function J of the positions at the last equilibrium, with slopes dJ/dx, this rank's rows,
  /// what it changes by with the numbers `names` of the springs (lattice/lattice.hpp) as the equilibrium follows: dJ/dp, (S) for each name, whole on
  /// every rank. Errors: as find_adjoint().
  PetscErrorCode sensitivities(const std::vector<double>& slope, const std::vector<std::string>& names, std::vector<std::vector<double>>* out);
  /// Collective. The last equilibrium for a program that asks for it; nothing where there is none.
  PetscErrorCode copy_to(Result* out);

  /// Within an observer of load steps (LoadStepObserver). Collective: the equilibrium of this moment; and: the run ends with it.
  PetscErrorCode frame(FrameData* out);
  PetscErrorCode pause() { return run_->pause(); }

  Equilibrium& equilibrium() { return *equilibrium_; }
  /// PETSc's stepper of the load steps; borrowed.
  TS stepper() const { return run_->stepper(); }
  const StaticsSettings& loads() const { return loads_; }
  /// The last one, and null until there is one, as under -help.
  Vec last() const { return last_; }
  /// Of it: load factor, observables, counts and the outcome; without model and state.
  FoundEquilibrium& found() { return found_; }
  /// The run ends; the model is the caller's.
  std::unique_ptr<Equilibrium> let_go();

 private:
  PetscErrorCode observe(double factor, Vec y, std::vector<Observable>* out);
  PetscErrorCode describe(double t, Vec y, FrameData* out);
  RunOptions options_;
  StaticsSettings loads_;
  OutputLocks locks_;  ///< given up when the files are closed
  std::unique_ptr<Equilibrium> equilibrium_;
  std::unique_ptr<FinalAnalyses> end_;  ///< null: nothing is wanted
  FoundEquilibrium found_;
  VecHandle last_;
  std::function<PetscErrorCode(double, Vec, std::vector<Observable>*)> assess_;
  std::unique_ptr<StaticRun> statics_;
  std::unique_ptr<Run> run_;
};

}  // namespace bs
