// Free vibrations about the start: -bs_task modes.
#pragma once
#include <memory>
#include <string>
#include <vector>
#include "base/error.hpp"
#include "linalg/eigen/mode_solver.hpp"
#include "output/progress.hpp"
#include "output/trajectory.hpp"
#include "systems/model.hpp"
#include "tasks/result.hpp"
#include "tasks/run_options.hpp"

namespace bs {

/// Collective. Reads -bs_modes and what goes with it, which run_modes goes by.
PetscErrorCode read_mode_options(MPI_Comm comm);

/// Collective. Solves -K q = omega^2 M q for some of its eigenpairs, writes them, the report and the summary.
/// Returns ERR_FAILED where not all of them were found (exit 3) or could not be written (exit 4).
/// `about`: unless null, the equilibrium of -bs_modes_about equilibrium, which is not looked for.
/// `result`: unless null, omega^2 and what is known of it.
PetscErrorCode run_modes(std::unique_ptr<Model> model, const SavedState* about, Result* result, int* exit_code);

class ModesRun {
 public:
  /// `y`: the state linearised at, at rest; it must outlive the object. `warnings`: those of the way there.
  ModesRun(Model& model, const RunOptions& options, const ModeRequest& request, double time, Vec y, const Facts& warnings)
      : model_(model),
        options_(options),
        request_(request),
        progress_(model.comm(), options.output.progress_interval),
        warnings_(model.comm()),
        y_(y),
        time_(time) {
    warnings_.restore(warnings);
  }
  PetscErrorCode run();
  /// Collective. omega^2, shapes and what is known of them.
  PetscErrorCode copy_results(Result* out);
  /// Collective. Where no equilibrium was found: the files hold its last state and no modes, in the place of an earlier run's.
  PetscErrorCode give_up(const std::string& outcome, const std::string& why);

 private:
  PetscErrorCode linearise();
  PetscErrorCode measure_forces();
  PetscErrorCode detect_damping();
  PetscErrorCode print_header(const std::string& method);
  PetscErrorCode find_effective_masses();
  PetscErrorCode page(std::size_t k, Vec* out);
  PetscErrorCode fluctuations(std::vector<Dataset>* constants);
  PetscErrorCode open_file();
  PetscErrorCode write_state();
  PetscErrorCode write();
  PetscErrorCode conclude(const std::string& why);
  PetscErrorCode report(const std::string& outcome, const std::string& why);
  std::vector<std::string> lines() const;
  std::vector<std::pair<std::string, std::string>> omega_attributes() const;

  Model& model_;
  RunOptions options_;
  ModeRequest request_;
  Progress progress_;
  Warnings warnings_;
  Vec y_;  ///< (x, 0)
  double time_;
  StandardForm form_;
  VecHandle shape_;  ///< of one mode, over all components
  VecHandle state_;  ///< a mode in the place of positions, on its way to the input's order
  Modes modes_;
  std::unique_ptr<Trajectory> file_;           ///< null: none is wanted
  double largest_force_ = 0, force_size_ = 0;  ///< of single particles [N]; the second without cancellation
  bool damped_ = false;
  std::vector<double> participation_;  ///< (K, d) effective masses [kg]
  double mass_ = 0;                    ///< of the particles that can move [kg]
  std::int64_t motions_ = 0;           ///< their components that can
};

}  // namespace bs
