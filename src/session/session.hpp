// A lattice, its settings and a communicator, for programs that compute with the library: steps, equilibria, modes and moduli without files and
// without a command line. Sessions of one process do not disturb one another. Errors are values: no call prints, ends the process or installs a
// handler of signals.
#pragma once
#include <petscts.h>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>
#include "base/error.hpp"
#include "lattice/lattice_arrays.hpp"
#include "solvers/step_record.hpp"
#include "systems/client.hpp"
#include "systems/saved_state.hpp"
#include "tasks/result.hpp"

namespace bs {

class KeptCheckpoint;
class Model;

/// Options as on the command line: names with their dash, values as text; of a flag the value may be empty.
using Settings = std::vector<std::pair<std::string, std::string>>;

/// Numbers of a whole lattice, by name.
using NumberTable = std::map<std::string, std::shared_ptr<const std::vector<double>>>;

/// Starts MPI and PETSc, unless they are started, for a program without a command line, and ends what it has started: no files of options are read,
/// and no signal handler is installed. Sessions live within it, or within the caller's own PetscInitialize.
class Library {
 public:
  Library();
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library();
  /// Whether PETSc is there.
  bool started() const { return there_; }

 private:
  bool mpi_ = false, petsc_ = false, there_ = false;
};

/// On several ranks PTScotch divides the lattice among them. Its threads make that, and so the last digits, differ from run to run unless
/// SCOTCH_PTHREAD_NUMBER=1 is in the environment, where the program puts it.
/// Everything is collective on the session's communicator but what says otherwise. An Error without text is none. After an error of one rank alone
/// (base/error.hpp) the ranks are no longer together: the caller has to end them.
class Session {
 public:
  /// When the system that is stepped is made of the lattice: by create(), which then tells what is wrong with it, or at the first call that needs it;
  /// analyses make their own and need none.
  enum class Make { at_once, when_needed };
  /// `lattice`: the whole of it, the same on every rank. Errors: sizes or values that make no lattice, unknown settings.
  static Error create(MPI_Comm comm, LatticeArrays lattice, const Settings& settings, std::unique_ptr<Session>* out, Make make = Make::at_once);
  /// The lattice that the settings name (-bs_lattice_file, -bs_lattice_type), or another system (-bs_model).
  static Error create(MPI_Comm comm, const Settings& settings, std::unique_ptr<Session>* out, Make make = Make::at_once);
  /// For a program with a command line: all that -bs_task names, by a session on `comm` itself and with the options in force. Errors, beside being
  /// held by `comm`, are told to its listener (base/error.hpp), and PETSc's own go to the handler in force. `exit_code`: 0, or 128 + signal.
  static PetscErrorCode perform(MPI_Comm comm, int* exit_code);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  /// Ends as finish() does.
  ~Session();

  /// Makes the system that is stepped, unless it is made; what is wrong with the lattice.
  Error prepare();
  /// `count` steps, each of the length that the settings ask for (-ts_dt, -ts_type and others), shorter where it would pass -ts_max_time or an output
  /// time. -ts_max_steps counts all steps of the session, also those before a state was set. Error (Exit::solve): a step that could not be taken; the
  /// last good state stays.
  Error step(std::int64_t count = 1);
  /// Steps up to the time t [s], at which the last one ends. Nothing where t is past. From the start on, the same as a run of the program with
  /// -ts_max_time t.
  Error run_until(double t);
  /// Steps up to the next output time (-bs_output_interval; without it, the next step) or the end (-ts_max_time), and stands there; `more`: false
  /// where the run was at its end and no step was taken, or -ts_max_steps allows no more, which is warned of once.
  Error run_to_frame(bool* more);
  /// Ends stepping: files that the settings name (-bs_output, -bs_report) are complete then. No step follows. What a step has
  /// failed with is in the report and is not returned again.
  Error finish();

  /// Of the lattice as it was given, by a model of its own, whatever has been stepped: equilibria under the loads as -bs_task statics finds them, and
  /// what -bs_task moduli adds; the `count` modes of -bs_task modes (-bs_modes). Of the session's settings those hold that say what the
  /// system is; those of PETSc's solvers, of steps and of files do not: `more` names, for this call, what the analysis needs of them.
  /// What has found the equilibrium stays until the next analysis, for follow().
  Error solve_statics(Result* out, const Settings& more = {});
  /// From the equilibrium that solve_statics() or follow() found last to the one it becomes under the same loads with the numbers that were given
  /// since; pattern, partition and symbolic factors stay, and sums of energies do not see what the numbers changed. Errors: as of solve_statics(),
  /// with the last equilibrium, which stays; there is none (Exit::input).
  Error follow(Result* out);
  /// Of the equilibrium that solve_statics() or follow() has found last: what a function J of its positions, of slopes dJ/dx, (N, d) whole, changes
  /// by with each number of springs and interactions that set_numbers() takes but damping, as the equilibrium follows: {name: dJ/dp, of each spring
  /// or interaction}, by one adjoint solve; numbers of interactions whose law does not say how its forces change with them are left out. Histories
  /// stay as they are. Errors: there is no equilibrium, or not of the numbers of now (Exit::input); as find_adjoint() (tasks/sensitivities.hpp).
  Error sensitivities(const std::vector<double>& slope, std::map<std::string, std::vector<double>>* out);
  Error moduli(Result* out, const Settings& more = {});
  /// `about`: unless null, the equilibrium that a result of solve_statics() or follow() stands at, of a session of the same lattice and settings on
  /// any number of ranks: modes about it, which is not looked for again (-bs_modes_about equilibrium).
  Error modes(std::int64_t count, Result* out, const Settings& more = {}, const SavedState* about = nullptr);

  /// Local. Time [s] and number of steps of the last good state.
  double time() const;
  std::int64_t steps() const;
  /// Particles of the whole, and this rank's rows [first, first + count) of the input; known once the system is made.
  Rows particles() const;
  int dim() const;

  /// Numbers of the particles at the last good state, (N, d), in the order of the input. reaction: what supports and motions exert on what is held.
  enum class Array { position, velocity, force, reaction };
  /// Of all particles, on every rank.
  Error get(Array what, std::vector<double>* all);
  /// Of this rank's rows.
  Error get_rows(Array what, std::vector<double>* rows);
  /// Numbers where a state has them: component c of row i is first[i * stride + c].
  struct View {
    const double* first = nullptr;
    std::int64_t rows = 0, stride = 0;
    std::shared_ptr<const void> memory;  ///< not freed before this, also where the session ends
  };
  /// Positions or velocities without a copy. They follow steps and states that are set or restored, but where set_numbers() makes the system anew
  /// (expect_changes()); within a step they may be those of an attempt. Error (Exit::input): they do not stand in the order of the input: particles
  /// on several ranks, or in an order of their own (-bs_ordering), or groups that are held or move as given.
  Error view(Array what, View* out);
  /// Positions or velocities of this rank's rows take the place of the last good state's, from which the method starts anew, without a history. What
  /// is held or moves as given stays where it is. Error (Exit::input): numbers that are not finite, or settings that name files of the run.
  Error set_rows(Array what, const std::vector<double>& rows);
  /// Numbers of the lattice that the session was created with, the whole of them, in the order of the input, the same on every rank: stiffness,
  /// rest_length, damping, or what the springs' laws take; mass; angle_stiffness, angle_rest_angle, hinge_stiffness, hinge_rest_angle. They hold in
  /// what is stepped, which goes on as after set_rows(), in what follow() finds, and in analyses to come. Errors (Exit::input): change_numbers()
  /// (lattice/lattice.hpp); a session without a lattice in memory.
  Error set_numbers(const std::string& name, const std::vector<double>& all);
  /// Systems made from now on (Make::when_needed) have room for springs that exert nothing yet, so that follow() goes on where set_numbers() gives
  /// them a stiffness; without it there is then no equilibrium to follow. What is stepped is made anew where it lacks room.
  void expect_changes();
  /// Local. The numbers of that name of now; empty where there are none.
  std::vector<double> numbers(const std::string& name) const;
  /// These springs, rows of the input, exert no force any more, and damp nothing: their numbers are 0 but those that cannot be, and stay so whatever
  /// set_numbers() is given. restore() of an earlier state brings them back.
  Error remove_springs(const std::vector<std::int64_t>& rows);
  /// The group, whose motion the settings call given (-bs_motion_NAME given), moves uniformly from where it is to be at time t [s], which is to come,
  /// where `rows` has its particles, this rank's rows as in set_rows(); others are not looked at. Then it stays there until the next call.
  Error drive(const std::string& group, double t, const std::vector<double>& rows);
  /// All that the system is at the last good state: positions and velocities, histories of springs and what is broken, works so far, the time, where
  /// given motions are, numbers that were given and springs that were removed, and what the method remembers of earlier steps.
  struct State : SavedState {
    std::int64_t steps = 0;
    std::int64_t number = 0;    ///< of the states that its session has saved
    std::uint64_t made_of = 0;  ///< fingerprint of the system as it was made
    SavedState::Parts shown;    ///< the state with what is held where it is
    /// Of every motion that is given: the state with what is held where it is at its two times.
    struct Way {
      std::string group;
      double from = 0, to = 0;
      SavedState::Parts there_from, there_to;
    };
    std::vector<Way> ways;
    std::shared_ptr<const KeptCheckpoint> run;
    NumberTable changed;             ///< numbers that were given since it was made
    std::set<std::int64_t> removed;  ///< springs
  };
  Error save(std::shared_ptr<const State>* out);
  /// `state`: of this session, or of another one of the same lattice and laws on as many ranks. Errors (Exit::input), and then nothing changes: it is
  /// none of these, or not the same on all ranks; settings that name files of the run. Steps that follow are those that followed save(), to the last
  /// digit, as after a restart from a file; where the settings name another method or step it starts anew.
  Error restore(const State& state);
  /// Before the first step: the springs' histories and what is broken become those of an equilibrium of a session of the same lattice, on any number
  /// of ranks, whose positions this one's lattice has; works and times begin anew.
  Error inherit(const SavedState& equilibrium);
  /// PETSc's stepper of the motion, with its SNES, KSP, state and matrices, to be looked at between steps; borrowed, until the session ends or goes
  /// on from a state that is set or restored. Who holds a reference may look at it after that, too: what would compute is an error of PETSc's then.
  Error stepper(TS* ts);
  /// The same of the load steps by which solve_statics() or follow() found an equilibrium last; until the next analysis, and of none where there is
  /// no equilibrium.
  Error load_stepper(TS* ts);
  /// What a frame of a trajectory would hold now, whole on every rank: observables, and fields that the settings ask for (-bs_output_springs). Within
  /// an observer of load steps, of their equilibrium.
  Error get_frame(FrameData* out);

  /// Called on every rank after every good step, also load steps of analyses, and where an output time is reached (-bs_output_interval; the start and
  /// the end always are). They may ask for arrays, not take steps.
  void on_step(std::function<void(const StepRecord&)> observer);
  void on_frame(std::function<void(double time)> observer);
  /// Within an observer, on all ranks: the call returns after the present step, without an error. The next call goes on; of load steps the present
  /// equilibrium is the last.
  void pause();
  /// Writes the last good state as a checkpoint, from which a session of the same lattice goes on by -bs_restart; a file of that name is replaced.
  Error checkpoint(const std::string& file);

  /// Asked on every rank between steps, also by analyses. Where it answers a number other than 0 on some rank, the call ends in an Error of that
  /// number plus 128 on all: the last good state stays.
  void on_poll(std::function<int()> poll);

  /// Forces beside those of the settings, in all systems that are made from now on (Make::when_needed), with a tangent and a potential where they are
  /// given.
  void on_force(ForceCallback forces);

  /// Local. What was warned of so far; on the first rank.
  const std::vector<std::string>& warnings() const;
  MPI_Comm comm() const;

 private:
  struct Impl;
  explicit Session(std::unique_ptr<Impl> impl);
  static Error create(MPI_Comm comm, std::unique_ptr<Lattice> given, const Settings& settings, Make make, std::unique_ptr<Session>* out);
  template <class Body>
  Error call(Body&& body);
  template <class Body>
  Error analyse(const Settings& more, Result* out, Body&& body);
  std::unique_ptr<Impl> impl_;
};

}  // namespace bs
