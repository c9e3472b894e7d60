// Equilibria under loads that grow in steps, by a run that can be kept and continued.
#pragma once
#include <memory>
#include "tasks/statics/static_run.hpp"

namespace bs {

/// The tasks that look for equilibria make a StaticSolver and destroy it at the end. A session keeps it: after numbers of the system were changed, it
/// finds the new equilibrium from the last one, with the same matrix pattern, partition and solvers.
class StaticSolver {
 public:
  StaticSolver() = default;
  StaticSolver(const StaticSolver&) = delete;
  StaticSolver& operator=(const StaticSolver&) = delete;
  /// Collective. Takes over the mechanics of `model`. Errors (exit 2): the model has no equilibria; loads act on a body that nothing holds.
  PetscErrorCode create(std::unique_ptr<Model> model, const StaticsSettings& loads, const RunOptions& options);
  /// Collective. Requests the analyses of the last equilibrium (compliance by its options, moduli where `moduli` is set) for a task; to be called
  /// before run().
  PetscErrorCode analyse(bool moduli);
  /// Collective. Takes all load steps, as Run::advance. Where the run fails, the equilibria found before are still available.
  PetscErrorCode run(int* exit_code);
  /// Collective, after a successful run that writes no files. Finds the equilibrium of the system as it is now (Mechanics::set_numbers), starting
  /// from the last one. Errors: none was found, and the last one is kept (exit 3); a path by arc length cannot be followed (exit 2).
  PetscErrorCode follow();
  /// Collective, after a successful run() or follow(). The derivatives dJ/dp of a function J of the positions at the last equilibrium by the numbers
  /// `names` of the springs (lattice/lattice.hpp), where the equilibrium follows them: (S) for each name, whole on every rank. `slope` is dJ/dx, this
  /// rank's rows. Errors: as find_adjoint().
  PetscErrorCode sensitivities(const std::vector<double>& slope, const std::vector<std::string>& names, std::vector<std::vector<double>>* out);
  /// Collective. Copies the last equilibrium to `out`, for programs that use the library; does nothing where there is none.
  PetscErrorCode copy_to(Result* out);

  /// Collective, to be called by an observer of load steps (LoadStepObserver): frame() gives the equilibrium of the present load step, pause() ends
  /// the run after it.
  PetscErrorCode frame(FrameData* out);
  PetscErrorCode pause() { return run_->pause(); }

  Equilibrium& equilibrium() { return *equilibrium_; }
  /// PETSc's TS that takes the load steps; it remains this object's.
  TS stepper() const { return run_->stepper(); }
  const StaticsSettings& loads() const { return loads_; }
  /// The state of the last equilibrium; null where none was found yet, as under -help.
  Vec last() const { return last_; }
  /// Load factor, observables, counts and outcome of the last equilibrium; its model and state are not filled in.
  FoundEquilibrium& found() { return found_; }
  /// Ends the run and gives the model to the caller.
  std::unique_ptr<Equilibrium> let_go();

 private:
  PetscErrorCode observe(double factor, Vec y, std::vector<Observable>* out);
  PetscErrorCode describe(double t, Vec y, FrameData* out);
  RunOptions options_;
  StaticsSettings loads_;
  OutputLocks locks_;  ///< released when the files are closed
  std::unique_ptr<Equilibrium> equilibrium_;
  std::unique_ptr<FinalAnalyses> end_;  ///< null: no analyses were requested
  FoundEquilibrium found_;
  VecHandle last_;
  std::function<PetscErrorCode(double, Vec, std::vector<Observable>*)> assess_;
  std::unique_ptr<StaticRun> statics_;
  std::unique_ptr<Run> run_;
};

}  // namespace bs
