// One run from its options to its closing report.
#pragma once
#include <functional>
#include <memory>
#include "base/error.hpp"
#include "output/progress.hpp"
#include "systems/model.hpp"
#include "tasks/adviser.hpp"
#include "tasks/result.hpp"
#include "tasks/run_options.hpp"
#include "time/energy_watch.hpp"
#include "time/tolerance_watch.hpp"
#include "time/ts_setup.hpp"

namespace bs {

/// What a task changes in a run. The default is dynamics.
struct RunHooks {
  bool loads = false;                                                                   ///< its time is a load factor
  Pace pace;                                                                            ///< defaults of the stepping
  std::string until = "; SNES";                                                         ///< text from which the header's line on the solver is kept
  std::string method;                                                                   ///< of the header, in place of the TS type's
  std::function<PetscErrorCode(TS, TSContext&)> attach;                                 ///< once the TS is made, before its options are in force
  std::function<PetscErrorCode(double time, Vec y, std::vector<Observable>*)> observe;  ///< adds to a frame's observables
  std::function<PetscErrorCode(std::vector<Tally>*)> count;                             ///< adds to the summary and the report
  std::function<void(Facts*)> save;                                                     ///< what a checkpoint holds of the task
  std::function<void(const Facts&)> restore;                                            ///< and back
  std::function<void(PetscMPIInt rank, std::vector<Dataset>*)> tables;                  ///< adds to a trajectory what `find` gives values
  std::function<PetscErrorCode(double time, Vec y, FinalResults*)> find;                ///< computes at the last state of a run that went well
  std::function<PetscErrorCode()> begin;                                                ///< before the first step of a run from its start
  Stepper::AfterBreak after_break;                                                      ///< when parts of the system broke
  std::function<bool()> done;                                                           ///< asked after every step: whether the run ends with it
  bool checkpoints = true;                                                              ///< whether its states can be continued
  bool open = false;                  ///< no end is given: what is given of motions must reach a step further
  bool only_run = true;               ///< whether options that it does not use are reported
  const char* clock = "load factor";  ///< what its time is, if it has load steps
  std::function<void(const std::string& outcome, const std::string& why)> concluded;  ///< at the end of what was computed
  std::function<void(const StepRecord&)> on_step;                                     ///< after every good step
  std::function<void(double time)> on_frame;                                          ///< at every frame, written or not
  std::function<PetscErrorCode(Warnings*)> final_warnings;                            ///< at the end, whatever the outcome: what to warn of
};

/// The components of a run, connected by the stepper's callbacks.
class Run {
 public:
  Run(Model& model, const RunOptions& options, RunHooks hooks = {})
      : model_(model),
        options_(options),
        hooks_(std::move(hooks)),
        progress_(model.comm(), options.output.progress_interval),
        warnings_(model.comm()),
        watch_(model, options.energy_growth, warnings_),
        step_watch_(model, warnings_) {}
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  ~Run();
  PetscErrorCode set_up();
  /// The whole run: begin, go_on, end. Returns ERR_FAILED where it failed (exit 3) or could not write (exit 4). `exit_code`: 0, or 128 + signal.
  PetscErrorCode advance(int* exit_code);
  /// Collective. The frame at the start, and what precedes the first step.
  PetscErrorCode begin();
  /// Collective. Up to the end, or `steps` steps, unless negative. Where the run fails, `end` says so.
  PetscErrorCode go_on(std::int64_t steps = -1);
  /// Collective. Why no step followed the last one; empty where one can.
  PetscErrorCode trouble(std::string* why);
  /// Collective. The last good state is kept, files are closed, report and summary written.
  PetscErrorCode end(int* exit_code);
  /// Collective, between steps. The last good state as a checkpoint.
  PetscErrorCode save(const std::string& file);
  /// Collective, between steps. The same in memory.
  PetscErrorCode keep(KeptCheckpoint* out);
  /// Collective. The run goes on to `time` [s]. Errors: Model::covers.
  PetscErrorCode set_end(double time);
  /// Collective. The run has no end that steps would be shortened for.
  PetscErrorCode leave_open();
  /// Collective, before begin(). Of the steps that -ts_max_steps allows, runs before this one have taken so many.
  PetscErrorCode count_earlier(std::int64_t steps);
  /// Collective. Whether -ts_max_steps allows no step more; if so, and the end is not come to, warns of it, once.
  PetscErrorCode out_of_steps(bool* yes);
  bool at_end() const { return stepper_->good_time() >= stepper_->end(); }
  double end_time() const { return stepper_->end(); }
  /// Whether all is at rest, where -bs_stop_at_rest asks for the end there.
  bool rests() const { return rests_; }
  double time() const { return stepper_->good_time(); }
  std::int64_t steps() const { return stepper_->counts().steps; }
  /// Simulated time between frames [s]; 0: a frame at every step.
  double output_interval() const { return options_.step.output_interval; }
  const RunCounts& counts() const { return stepper_->counts(); }
  PetscErrorCode save_warnings(Facts* out) const { return warnings_.save(out); }
  /// The signal that ended it; 0: none did.
  int signal() const { return stepper_->signal(); }
  /// Within on_step and on_frame: go_on returns after the present step.
  PetscErrorCode pause() { return TSSetConvergedReason(ts_, TS_CONVERGED_USER); }
  /// The last good state; borrowed.
  PetscErrorCode state_vector(Vec* y) const { return TSGetSolution(ts_, y); }
  /// Collective, after a step that failed: what the attempt left in the vector of the state becomes the last good one.
  PetscErrorCode return_to_good() { return stepper_->return_to_good(ts_); }
  /// PETSc's stepper; borrowed.
  TS stepper() const { return ts_; }

 private:
  PetscErrorCode on_step(const StepRecord& record);
  RunState state() const;
  PetscErrorCode final_warnings(TSConvergedReason reason);
  PetscErrorCode warn_of_cuts();
  PetscErrorCode warn_of_early_end();
  PetscErrorCode end_at_rest(double time, Vec y);
  PetscErrorCode observe(double time, Vec y);
  PetscErrorCode require_form(Vec y);
  PetscErrorCode on_frame(PetscInt step, double time, Vec y);
  PetscErrorCode give_up_frame(double time, const std::string& what, const std::vector<Observable>& before);
  double shown_time(double time) const;
  PetscErrorCode on_flush();
  PetscErrorCode on_save();
  PetscErrorCode open_restart();
  PetscErrorCode choose_interval();
  PetscErrorCode cut_by_output(double* h, double* cut);
  PetscErrorCode warn_of_interval();
  PetscErrorCode print_header(const std::string& solver);
  PetscErrorCode prepare_solvers();
  PetscErrorCode check_end();
  PetscErrorCode continue_from_checkpoint();
  PetscErrorCode open_trajectory();
  PetscErrorCode save_last(bool failed);
  PetscErrorCode after_break(double time, Vec y, const std::function<PetscErrorCode(Vec)>& frame, bool* found, std::string* failure);
  PetscErrorCode facts(Facts* now) const;
  PetscErrorCode good_facts(Facts* good) const;
  void restore_facts();
  bool idle() const { return stepper_->counts().steps == steps_at_restart_; }
  bool untouched() const { return resumed_ && idle() && !abandoned_.shown; }  ///< the trajectory that goes on
  PetscErrorCode run_final_analyses();
  PetscErrorCode write_breaks();
  PetscErrorCode conclude(TSConvergedReason reason, int* exit_code);
  PetscErrorCode report(const std::string& outcome, const std::string& why);
  PetscErrorCode explain(TSConvergedReason reason, std::string* text);
  std::vector<std::string> closing_lines() const;
  std::vector<Tally> tallies() const;

  Model& model_;
  RunOptions options_;
  RunHooks hooks_;
  Progress progress_;
  Warnings warnings_;
  EnergyWatch watch_;
  StepWatch step_watch_;
  ToleranceWatch tolerance_watch_;
  TSContext context_;
  TSHandle ts_;
  std::unique_ptr<Stepper> stepper_;
  std::unique_ptr<Trajectory> trajectory_;
  Advice advice_;
  std::shared_ptr<const Checkpoint> restart_;
  std::int64_t steps_at_restart_ = -1;  ///< steps at the checkpoint; -1: from the start
  Facts inputs_;                        ///< fingerprints of the tables that options name
  Facts good_facts_;                    ///< facts() of the last good state, where steps may be taken back
  Facts continued_;                     ///< what the checkpoint holds of the run
  /// A motion after a break whose step was taken back.
  struct AbandonedMotion {
    bool shown = false;     ///< there are frames of it
    TrajectoryMark before;  ///< where the trajectory stood
    double time = 0;        ///< by which its end lies behind the last good state [s]
    std::int64_t steps = 0;
  };
  AbandonedMotion abandoned_;
  std::map<std::string, std::int64_t> earlier_;  ///< counts of the runs that this one continues
  std::string solver_;                           ///< as the header describes it
  std::string last_checkpoint_;                  ///< where a failed run can be continued from
  std::vector<Observable> first_, last_;
  double observed_ = 0;  ///< when last_ was [s]
  double start_ = 0, end_ = 0;
  std::int64_t earlier_steps_ = 0;          ///< of runs before this one, by one session
  std::int64_t pause_at_ = -1;              ///< step after which TSSolve returns; -1: none
  std::vector<std::string> changed_form_;   ///< options of the trajectory's form that are not as the checkpoint has them
  std::string interval_note_;               ///< of the header, where the distance of frames was chosen
  double most_force_ = 0, most_speed_ = 0;  ///< 2-norms of f and of sqrt(M) v, since the run began
  FinalResults results_;
  int held_rows_ = 0;      ///< of the log, not yet written
  bool resumed_ = false;   ///< the trajectory goes on where the checkpoint left it
  bool relaxing_ = false;  ///< a frame now is not of a good state
  bool spoiled_ = false;   ///< a frame was not finite: the run ends, and nothing is kept of the state
  bool rests_ = false;
};

/// An end of a run that has none [s], many steps away from `time`: further off, it would be rounded too coarsely for landing on it.
inline double far_from(double time, double step) { return time + 1e6 * step; }

/// Of a frame's observables [J]; NaN if they have none.
double total_energy(const std::vector<Observable>& observables);

}  // namespace bs
