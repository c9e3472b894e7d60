// Stepping policy around a TS: output times hit exactly, the nominal step restored after a shortened or rejected one,
// every step checked before it counts.
#pragma once
#include <petscts.h>
#include <functional>
#include <string>
#include "model/model.hpp"
#include "output/trajectory.hpp"
#include "solve/history.hpp"
#include "solve/linear_reuse.hpp"
#include "solve/rejections.hpp"
#include "solve/ts_setup.hpp"

namespace bs {

struct StepOptions {
  double output_interval = 0;   ///< -bs_output_interval [s]; 0: no output times but the end
  bool every_step = false;      ///< a frame after every step
  double cut = 0.25;            ///< -bs_step_cut: factor on h after a failed solve
  std::int64_t grow_after = 3;  ///< -bs_step_grow_after: good steps before h grows back
  double step_min = 0;          ///< -bs_step_min [s]: no attempt below it; 0: only max_cuts ends them
  std::int64_t max_cuts = 10;   ///< -bs_step_max_cuts: rejections of one step that are borne
  double first = 0;             ///< -bs_step_first [s]; 0: chosen
  std::int64_t save_every = 0;  ///< -bs_checkpoint_every: steps between checkpoints; 0: not by steps
  double save_minutes = 0;      ///< -bs_checkpoint_minutes: wall-clock time between them; 0: not by the clock
};

/// What a run did, for the summary and the report.
struct RunCounts {
  PetscInt steps = 0, rejected = 0, newton = 0, krylov = 0, shortened = 0;
};

/// Drives the steps of one TSSolve. Callbacks: on_step after every good step, on_frame when an output time is reached,
/// on_save, last of all, when a checkpoint is due.
class Stepper {
 public:
  using OnStep = std::function<PetscErrorCode(const StepRecord&)>;
  using OnFrame = std::function<PetscErrorCode(PetscInt step, double time, Vec)>;
  using OnSave = std::function<PetscErrorCode()>;
  Stepper(Model& model, TSContext& context, const StepOptions& options, OnStep on_step, OnFrame on_frame, OnSave on_save);
  /// Hooks into `ts`, whose type, step and final time are set.
  PetscErrorCode attach(TS ts);
  /// Collective. Once the solvers are set up.
  PetscErrorCode attach_solvers(TS ts);
  /// What a checkpoint of the last good state holds of the stepping.
  void save(Facts* facts, std::vector<NamedState>* states) const;
  /// Collective. After attach_solvers: `ts` goes on where `file` was written. `told` receives what is not as it was.
  PetscErrorCode restore(TS ts, const CheckpointFile& file, std::vector<std::string>* told);
  const RunCounts& counts() const { return counts_; }
  double start() const { return start_; }
  /// Last time whose state is good, and whether its frame is written.
  const RejectionWatch& rejections() const { return rejections_; }
  double good_time() const { return good_time_; }
  bool framed() const { return framed_; }
  void set_framed(bool framed) { framed_ = framed; }
  /// Why the run ended early (empty: it did not).
  const std::string& trouble() const { return trouble_; }
  /// Why no step can follow a good one (empty: one can).
  const std::string& ending() const { return ending_; }
  int signal() const { return signal_; }
  /// Whether the log of steps has waited long enough (ten seconds); the same on every rank.
  bool log_due() const { return log_due_; }
  /// Collective. No solver goes on with what it kept from earlier steps: after a checkpoint, so that the run and its
  /// continuation do the same.
  PetscErrorCode renew_solver(TS ts) const;

 private:
  static PetscErrorCode pre_step(TS ts);
  static PetscErrorCode post_step(TS ts);
  static PetscErrorCode pre_stage(TS ts, PetscReal time);
  static PetscErrorCode post_stage(TS ts, PetscReal time, PetscInt index, Vec* stages);
  PetscErrorCode choose_step(TS ts);
  PetscErrorCode accept_step(TS ts);
  PetscErrorCode repeat_start(TS ts, bool* again);
  std::string lost_steps(double t, double h, double least) const;
  PetscErrorCode tell_lost_steps(double t, double h) const;
  PetscErrorCode prime_solvers(TS ts, double sigma_step);
  PetscErrorCode check_state(TS ts, bool* finite);
  PetscErrorCode krylov_iterations(TS ts, PetscInt* count);
  void restore_step(bool landed, double taken, double* next);
  double next_output(double time) const;

  Model& model_;
  TSContext& context_;
  StepOptions options_;
  LinearReuse reuse_;
  OnStep on_step_;
  OnFrame on_frame_;
  OnSave on_save_;
  History history_;
  RejectionWatch rejections_;
  bool adaptive_ = false, framed_ = true;
  bool alpha_ = false, own_start_ = false, again_ = false;  ///< own_start_: this step's cuts are ours; again_: it is repeated
  bool blind_ = false;    ///< the type's first step has no error estimate
  double start_ = 0, end_ = 0, nominal_ = 0, planned_ = 0, target_ = 0, good_time_ = 0, saved_ = 0, next_ = 0, first_ = 0;
  double saved_at_ = 0;  ///< wall clock of the last checkpoint
  bool save_due_ = false, log_due_ = false;
  double logged_at_ = 0;  ///< wall clock when the log was last due
  bool landing_ = false;
  std::int64_t frame_ = 1, good_in_a_row_ = 0;
  RunCounts counts_;
  RejectionCounts rejected_before_{};
  std::string trouble_, ending_;
  int signal_ = 0;
  RunCounts base_;  ///< what TS had counted less than the run, when it was taken up
};

}  // namespace bs
