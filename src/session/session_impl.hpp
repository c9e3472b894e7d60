// What a session is made of.
#pragma once
#include <petscvec.h>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "checkpoint/checkpoint.hpp"
#include "session/inside.hpp"
#include "session/session.hpp"
#include "tasks/run.hpp"
#include "tasks/statics/static_solver.hpp"

namespace bs {

struct Session::Impl {
  MPI_Comm comm = MPI_COMM_NULL;  ///< a duplicate of the caller's; errors, warnings and found files are attached to it
  bool borrowed = false;          ///< comm and the table of options are the caller's own, not duplicates
  Settings settings;
  std::unique_ptr<Lattice> given;  ///< the whole lattice as the caller gave it; null: the settings name a file or a generator
  OptionTable options;
  std::vector<std::string> warnings;
  std::function<void(const StepRecord&)> step_observer;
  std::function<void(double)> frame_observer;
  Rows particles;
  int dim = 0;  ///< dimensions of the model made last

  std::unique_ptr<Model> model;                   ///< the model that is stepped
  std::uint64_t made_of = 0;                      ///< the model's fingerprint when it was made
  NumberTable original, changed;                  ///< of numbers that were changed since the model was made: the values then and now
  double end_of_settings = 0;                     ///< end of the run by the settings [s]; NaN: they name none
  std::set<std::int64_t> removed;                 ///< rows of the springs that were removed
  std::int64_t saved = 0;                         ///< how many states were saved so far
  std::unique_ptr<OutputLocks> locks;             ///< locks of the files that are written
  std::unique_ptr<Run> run;                       ///< the present run; null: no step was taken yet
  double start = 0;                               ///< time at which the next run begins, as long as there is none [s]
  std::shared_ptr<const Checkpoint> resumed;      ///< the method's history that the next run continues, with given_state; null: it begins anew
  std::int64_t earlier_steps = 0;                 ///< steps of the runs before this one
  VecHandle given_state;                          ///< state that the next run begins with; null: the initial state of the model
  std::unique_ptr<OptionTable> analysis_options;  ///< options of the last analysis, in force while it or follow() computes
  std::unique_ptr<StaticSolver> statics;          ///< the last analysis if it looked for equilibria, else null
  bool loading = false;                           ///< `statics` is taking load steps
  bool current = false;                           ///< the last equilibrium was found with the present numbers of the springs
  bool stop_at_frame = false, finished = false, paused = false;
  bool failed = false;  ///< the last step of the run failed
  bool viewed = false;  ///< a View of the state's vector was given out

  PetscErrorCode perform(int* exit_code);
  PetscErrorCode take_up_settings();
  PetscErrorCode open();
  PetscErrorCode make_model(std::unique_ptr<Model>* out);
  PetscErrorCode make_run(const char* user, bool keep_input, const RunHooks& hooks, std::unique_ptr<Run>* out);
  PetscErrorCode count_particles();
  PetscErrorCode begin();
  PetscErrorCode dynamics(int* exit_code);
  PetscErrorCode advance(std::int64_t count);
  PetscErrorCode step(std::int64_t count);
  PetscErrorCode return_to_end();
  PetscErrorCode run_until(double t);
  PetscErrorCode finish();
  PetscErrorCode run_to_frame(bool* more);
  PetscErrorCode get(Array what, std::vector<double>* rows);
  PetscErrorCode view(Array what, View* out);
  PetscErrorCode show_given();
  PetscErrorCode set(Array what, const std::vector<double>& rows);
  PetscErrorCode get_frame(FrameData* out);
  PetscErrorCode forces(double t, Vec y, Array what, std::vector<double>* rows);
  PetscErrorCode start_anew(double time, std::int64_t steps);
  PetscErrorCode check_rows(const std::vector<double>& rows);
  PetscErrorCode require_particles();
  static std::string file_of_run();
  PetscErrorCode refuse_files();
  PetscErrorCode drive(const std::string& group, double t, const std::vector<double>& rows);
  PetscErrorCode save(State* out);
  PetscErrorCode leave_failed_run();
  PetscErrorCode show_held(double t, Vec y, SavedState::Parts* out);
  PetscErrorCode lead(const std::string& group, double from, double to, const SavedState::Parts& there);
  PetscErrorCode check_state(const State& state);
  PetscErrorCode restore(const State& state);
  PetscErrorCode inherit(const SavedState& equilibrium);
  NumberTable numbers_of(const State& state) const;
  PetscErrorCode restore_numbers(const State& state);
  PetscErrorCode checkpoint(const std::string& file);
  PetscErrorCode modes(Result* out, const SavedState* about, int* exit_code);
  PetscErrorCode solve_statics(Analyses analyses, Result* out, int* exit_code);
  PetscErrorCode follow(Result* out);
  PetscErrorCode sensitivities(const std::vector<double>& slope, std::map<std::string, std::vector<double>>* out);
  void drop_statics();
  PetscErrorCode set_numbers(const std::string& name, const std::vector<double>& all);
  PetscErrorCode make_room(const std::string& name, const std::vector<double>& all);
  PetscErrorCode pass_on(const std::string& name, const std::vector<double>& all);
  std::vector<std::string> numbers_of_removed() const;
  PetscErrorCode remove_springs(const std::vector<std::int64_t>& rows);
  PetscErrorCode require_given();
  PetscErrorCode hold_state();
  PetscErrorCode stopped(int exit_code) const;
  std::int64_t steps_so_far() const { return earlier_steps + (run ? run->steps() : 0); }
  ~Impl();
};

}  // namespace bs
