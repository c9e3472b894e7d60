// Drives the steps of one TSSolve: output times hit exactly, the nominal step restored after a shortened or rejected one,
// every step checked before it counts. What each step needs to know is kept by the parts in stepping/.
#pragma once
#include <petscts.h>
#include <functional>
#include <string>
#include "solvers/step_record.hpp"
#include "systems/model.hpp"
#include "time/history.hpp"
#include "time/implicit/linear_reuse.hpp"
#include "time/rejections.hpp"
#include "time/stepping/step_length.hpp"
#include "time/ts_setup.hpp"

namespace bs {

struct StepOptions {
  StepRules length;
  double output_interval = 0;   ///< -bs_output_interval [s]; 0: no output times but the end
  bool every_step = false;      ///< a frame after every step
  bool open = false;            ///< no end is given: before each step, what is given of motions must reach its end
  std::int64_t max_cuts = 10;   ///< -bs_step_max_cuts: rejections allowed per step
  std::int64_t save_every = 0;  ///< -bs_checkpoint_every: steps between checkpoints; 0: none by steps
  double save_minutes = 0;      ///< -bs_checkpoint_minutes: wall-clock time between them; 0: none by the clock
  double flush_seconds = 2;     ///< -bs_output_flush
};

/// Callbacks: on_step after every good step, on_frame when an output time is reached, on_flush when frames and log have waited
/// for long enough, on_save, last of all, when a checkpoint is due.
class Stepper {
 public:
  using OnStep = std::function<PetscErrorCode(const StepRecord&)>;
  using OnFrame = std::function<PetscErrorCode(PetscInt step, double time, Vec)>;
  using OnFlush = std::function<PetscErrorCode()>;
  using OnSave = std::function<PetscErrorCode()>;
  Stepper(Model& model, TSContext& context, const StepOptions& options, OnStep on_step, OnFrame on_frame, OnFlush on_flush, OnSave on_save);
  /// Hooks into `ts`, whose type, step and final time are set.
  PetscErrorCode attach(TS ts);
  /// Collective. Once the solvers are set up.
  PetscErrorCode attach_solvers(TS ts);
  /// What a checkpoint of the last good state holds of the stepping.
  void save(Facts* facts, std::vector<NamedState>* states) const;
  /// Collective. After attach_solvers: `ts` goes on where `file` was written. `not_restored` receives what could not be restored.
  PetscErrorCode restore(TS ts, const Checkpoint& file, std::vector<std::string>* not_restored);
  /// Called when parts of the system broke at the end of a step: makes it a state that the task can go on from (`found`), or says in `failure` why
  /// it cannot; then, or where a signal came in between, the step does not count and the run ends. `frame` writes a frame of what lies between.
  using AfterBreak =
      std::function<PetscErrorCode(double time, Vec y, const std::function<PetscErrorCode(Vec)>& frame, bool* found, std::string* failure)>;
  void set_after_break(AfterBreak on_break) { after_break_ = std::move(on_break); }
  /// Called once, before the next step, whose start it may change.
  void set_on_begin(std::function<PetscErrorCode()> on_begin) { on_begin_ = std::move(on_begin); }
  /// The steps that follow end at `end`, later than the last good state [s].
  PetscErrorCode set_end(TS ts, double end);
  double end() const { return clock_.end(); }
  /// Iterations so far are the run's, and no step's.
  PetscErrorCode count_start(TS ts);
  /// The run ends after the present step for this reason, as a failed one.
  void give_up(const std::string& why) { give_up_reason_ = why; }
  const RunCounts& counts() const { return counter_.counts(); }
  double start() const { return clock_.start(); }
  double nominal_step() const { return length_.nominal(); }
  /// What the nominal step was cut to after rejections, at the least; 0: it never was [s].
  double shortest_cut() const { return length_.shortest_cut(); }
  const RejectionWatch& rejections() const { return rejections_; }
  /// Collective, after a step that failed: the state becomes the last good one.
  PetscErrorCode return_to_good(TS ts);
  /// Last time whose state is good, and whether its frame is written.
  double good_time() const { return good_time_; }
  bool framed() const { return framed_; }
  /// Why the run ended early (empty: it did not).
  const std::string& trouble() const { return trouble_; }
  /// Why no step can follow a good one (empty: one can).
  const std::string& ending() const { return ending_; }
  int signal() const { return now_.signal; }
  /// Whether what waits is due to be written, after StepOptions::flush_seconds; the same on every rank.
  bool flush_due() const { return now_.flush_due; }
  /// Collective. Discards what the solvers kept from earlier steps: after a checkpoint, so that the run and its
  /// continuation do the same.
  PetscErrorCode renew_solver(TS ts) const;

 private:
  /// The outcome of a finished step, the same on all ranks.
  struct Verdict {
    bool finite = true;                        ///< its state
    int signal = 0;                            ///< that ends the run; 0: none
    bool save_due = false, flush_due = false;  ///< by the wall clock, or a signal that asks for a checkpoint
  };
  static Stepper& of(TS ts);
  PetscErrorCode before_stage(TS ts, PetscReal time);
  PetscErrorCode begin_step(TS ts);
  PetscErrorCode set_sides(TS ts);
  PetscErrorCode plan_length(TS ts);
  PetscErrorCode leave_knot(TS ts, double time);
  PetscErrorCode begin_attempt(TS ts, double h, Vec y);
  PetscErrorCode renew_kept_forces(TS ts, double time, Vec y);
  PetscErrorCode accept_step(TS ts);
  PetscErrorCode count_step(TS ts, StepRecord* record);
  PetscErrorCode count_iterations(TS ts, StepRecord* record);
  PetscErrorCode is_good(TS ts, bool* good);
  PetscErrorCode reduce_verdict(TS ts);
  PetscErrorCode keep_step(TS ts, StepRecord* record, bool* landed, bool* counts);
  PetscErrorCode after_break(TS ts, Vec y, StepRecord* record, bool* counts);
  PetscErrorCode undo_step(TS ts);
  PetscErrorCode write_frame_if_due(TS ts, const StepRecord& record, bool landed);
  PetscErrorCode decide_what_follows(TS ts, double time, bool finished);
  PetscErrorCode save_if_due(std::int64_t step, bool finished);
  PetscErrorCode check_start(TS ts, double t, double h);
  PetscErrorCode foresee_next(double time, std::string* fault);
  PetscErrorCode require_facts(const Checkpoint& file) const;
  PetscErrorCode stand_at(TS ts, const Facts& run, std::string* changed);
  PetscErrorCode restore_counts(TS ts, const Facts& run);
  PetscErrorCode restore_method(TS ts, const Checkpoint& file, std::vector<std::string>* not_restored);

  Model& model_;
  TSContext& context_;
  StepOptions options_;
  OnStep on_step_;
  OnFrame on_frame_;
  OnFlush on_flush_;
  OnSave on_save_;
  AfterBreak after_break_;
  std::function<PetscErrorCode()> on_begin_;

  OutputClock clock_;
  StepLength length_;
  StepCounter counter_;
  WallSchedule schedule_;
  Knot knot_;  ///< at which the present step is to end, where it is no output time, or is one as well
  Sides sides_;
  RejectionWatch rejections_;
  History history_;
  LinearReuse reuse_;

  double good_time_ = 0;
  bool framed_ = true;
  Facts before_;  ///< of the stepping before the present step, where it may be taken back
  Verdict now_;
  std::string trouble_, ending_, give_up_reason_;
};

}  // namespace bs
