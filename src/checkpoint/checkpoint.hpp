// Checkpoints, from which a run can be continued: files (layout: README.md), and states kept in memory.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>
#include "base/facts.hpp"
#include "input/hdf5_file.hpp"
#include "systems/model.hpp"
#include "systems/saved_state.hpp"

namespace bs {

/// The version of the layout this program writes; it reads this and older ones.
constexpr std::int64_t CHECKPOINT_VERSION = 2;

/// Attribute of /system that marks runs with forces from a callback, which no file can hold.
constexpr const char* FORCED_OUTSIDE = "forces_outside";
/// Whether the model has such forces.
bool forced_outside(Model& model);

/// A state to be written: its group in the file and its vector in the solver's order (not owned).
struct NamedState {
  std::string group;  ///< "/state", "/history/0", ...
  Vec vec;
};

/// Name under which the checkpoint before the last is kept.
std::string previous_checkpoint(const std::string& file);

/// Collective. Writes to a temporary name, flushes to disk, keeps what `file` was as previous_checkpoint(file), then
/// renames: a complete checkpoint exists at every moment. A failure ends the run with exit code 4 and keeps the old file.
PetscErrorCode write_checkpoint(Model& model, const std::string& file, const Facts& run, const std::vector<NamedState>& states);

/// What a run continues from: counts and times of the stepping, the state, and the earlier states that the method remembers.
class Checkpoint {
 public:
  virtual ~Checkpoint() = default;
  const Facts& run() const { return run_; }
  /// Name for messages.
  const std::string& name() const { return name_; }
  virtual bool has(const std::string& group) const = 0;
  /// Collective. Reads the state of `group` into y, in the solver's order. Ends the run with exit code 2 if it is damaged.
  PetscErrorCode read(Model& model, const std::string& group, Vec y) const;
  /// Collective. Reads what the model carries from step to step, beside its state. Ends the run with exit code 2 if it is damaged.
  virtual PetscErrorCode read_memory(Model& model) const = 0;

 protected:
  /// Collective. Reads the numbers of `group` into the vectors of `parts`, by their names.
  virtual PetscErrorCode read_parts(MPI_Comm comm, const std::string& group, const std::vector<StatePart>& parts) const = 0;
  std::string name_;
  Facts run_;
};

/// A checkpoint in a file.
class CheckpointFile : public Checkpoint {
 public:
  /// Collective. Ends the run with exit code 2 if the file is missing, damaged, not a checkpoint, or of a newer version.
  PetscErrorCode open(MPI_Comm comm, const std::string& file);
  /// Collective. Ends the run with exit code 2 if it was written for another model, dimension, number of rows, or lattice.
  PetscErrorCode require_same(Model& model) const;
  /// Names, without dashes, and values of the options in force when it was written.
  const std::vector<std::pair<std::string, std::string>>& options() const { return options_; }
  bool has(const std::string& group) const override { return file_.has(group); }
  PetscErrorCode read_memory(Model& model) const override;

 private:
  PetscErrorCode read_parts(MPI_Comm comm, const std::string& group, const std::vector<StatePart>& parts) const override;
  PetscErrorCode require_memory(const std::vector<StatePart>& parts) const;
  PetscErrorCode damaged(const std::string& what) const;
  MPI_Comm comm_ = MPI_COMM_NULL;
  Hdf5File file_;
  std::vector<std::pair<std::string, std::string>> options_;
};

/// Whether the option (named without its dash) concerns a single run: a run that continues another neither takes it over nor warns that it differs.
bool of_this_run_only(const std::string& option);

/// Collective. Adds the options of the checkpoint named by -bs_restart to those given, which take precedence, and notes that they were recalled.
/// Options of PETSc's that write files or load libraries are left out, and so is a trajectory or checkpoint that does not lie beside it
/// (base/option_names.hpp).
PetscErrorCode recall_options(MPI_Comm comm);

/// Collective. Adds to `inputs` a fingerprint of the contents of every table and text that an option names.
PetscErrorCode fingerprint_inputs(MPI_Comm comm, Facts* inputs);

/// Collective. `now` is from fingerprint_inputs(). Ends the run with exit code 2 if an input whose name was recalled has changed since `file` was
/// written; only warns if its name was given again.
PetscErrorCode require_same_inputs(MPI_Comm comm, const CheckpointFile& file, const Facts& now);

/// An option in force, without its dash, whose value differs from that when a checkpoint was written; `was`: the value then, or NOT_GIVEN.
inline constexpr const char* NOT_GIVEN = "not given";
struct ChangedOption {
  std::string name, value, was;
};
PetscErrorCode changed_options(const CheckpointFile& file, std::vector<ChangedOption>* found);

/// Collective. Warns of the changed options that affect the results. `form` receives those, as they were given, that choose the form of the
/// trajectory, which a trajectory that is continued may not take (Trajectory::require_form).
PetscErrorCode warn_changed_options(MPI_Comm comm, const CheckpointFile& file, std::vector<std::string>* form);

/// A checkpoint in memory, for a run on as many ranks. It does not hold what the system carries beside the state: the caller restores that by
/// put_memory() (systems/saved_state.hpp).
class KeptCheckpoint : public Checkpoint {
 public:
  /// Collective. `states`: the state, named "/state", and the earlier ones that the method remembers.
  PetscErrorCode keep(Model& model, const Facts& run, const std::vector<NamedState>& states);
  bool has(const std::string& group) const override { return states_.count(group) > 0; }
  PetscErrorCode read_memory(Model&) const override { return 0; }

 private:
  PetscErrorCode read_parts(MPI_Comm comm, const std::string& group, const std::vector<StatePart>& parts) const override;
  std::map<std::string, SavedState::Parts> states_;
};

}  // namespace bs
