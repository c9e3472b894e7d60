// A lattice, its settings and a communicator, for programs that compute with the library: steps, equilibria, modes and moduli without files and
// without a command line. Sessions of one process do not disturb one another. Errors are values: no call prints, ends the process or installs a
// handler of signals.
#pragma once
#include <petscts.h>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
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

/// Options as on the command line: names with their dash, values as text; the value of a flag may be empty.
using Settings = std::vector<std::pair<std::string, std::string>>;

/// Numbers of the whole lattice (stiffness, mass, ...), by name.
using NumberTable = std::map<std::string, std::shared_ptr<const std::vector<double>>>;

/// Starts MPI and PETSc, unless they are running, for a program without a command line, and ends what it has started. No option files are read, and
/// no signal handler is installed. Sessions must be created and destroyed during its lifetime, or between the caller's own PetscInitialize and
/// PetscFinalize.
class Library {
 public:
  Library();
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library();
  /// Whether PETSc is running.
  bool started() const { return there_; }

 private:
  bool mpi_ = false, petsc_ = false, there_ = false;
};

/// All functions are collective on the session's communicator unless they say otherwise. An Error without text means success. After an error on one
/// rank alone (base/error.hpp) the ranks are out of step: the caller has to end them. On several ranks PTScotch divides the lattice among them. Its
/// threads make the division, and so the last digits of results, differ from run to run unless SCOTCH_PTHREAD_NUMBER=1 is in the environment (the
/// program sets it).
class Session {
 public:
  /// When the system that is stepped is made from the lattice: by create(), which then reports errors in the lattice, or by the first call that needs
  /// it. Analyses make a system of their own and do not need it.
  enum class Make { at_once, when_needed };
  /// `lattice` is the whole lattice, the same on every rank. Errors: sizes or values that make no lattice, unknown settings.
  static Error create(MPI_Comm comm, LatticeArrays lattice, const Settings& settings, std::unique_ptr<Session>* out, Make make = Make::at_once);
  /// A session of the lattice that the settings name (-bs_lattice_file, -bs_lattice_type), or of another system (-bs_model).
  static Error create(MPI_Comm comm, const Settings& settings, std::unique_ptr<Session>* out, Make make = Make::at_once);
  /// For a program with a command line: does all that -bs_task asks for, in a session on `comm` itself and with the options in force. Errors are
  /// attached to `comm` and passed to its listener (base/error.hpp); PETSc's own go to the error handler in force. `exit_code`: 0, or 128 + signal.
  static PetscErrorCode perform(MPI_Comm comm, int* exit_code);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  /// Calls finish().
  ~Session();

  /// Makes the system that is stepped, unless there is one already. Errors: what is wrong with the lattice.
  Error prepare();
  /// Takes `count` steps, each of the length that the settings ask for (-ts_dt, -ts_type and others), shorter where it would pass -ts_max_time or an
  /// output time. -ts_max_steps counts all steps of the session, also those before a state was set. Error (Exit::solve): a step failed; the last good
  /// state is kept.
  Error step(std::int64_t count = 1);
  /// Takes steps up to the time t [s], at which the last one ends; none where t is past. From the start, this is a run of the program with
  /// -ts_max_time t.
  Error run_until(double t);
  /// Takes steps up to the next output time (-bs_output_interval; without it, one step) or the end (-ts_max_time). `more` is false where no step was
  /// taken because the run was at its end, or because -ts_max_steps allows no more, of which a warning is given once.
  Error run_to_frame(bool* more);
  /// Ends stepping: files that the settings name (-bs_output, -bs_report) are complete afterwards, and no step can be taken. The error of a failed
  /// step is in the report and is not returned again.
  Error finish();

  /// Analyses of the lattice as it was given, with a model of their own, whatever was stepped before: the equilibria under the loads that -bs_task
  /// statics finds, the moduli of -bs_task moduli, the `count` modes of -bs_task modes (-bs_modes). The session's settings hold as far as they
  /// describe the system; those of PETSc's solvers, of steps and of files do not: `more` gives them for this call. The solver that found the
  /// equilibrium is kept for follow() until the next analysis.
  Error solve_statics(Result* out, const Settings& more = {});
  /// Finds the equilibrium under the same loads with the numbers that were changed since solve_statics() or follow() found the last one, starting
  /// from that; matrix pattern, partition and symbolic factors are kept. Sums of energies leave out what the change of numbers did. Errors: those of
  /// solve_statics(), with the last equilibrium, which is kept; there is no equilibrium yet (Exit::input).
  Error follow(Result* out);
  /// Derivatives of a function J of the positions of the last equilibrium by each number of springs and interactions that set_numbers() takes, except
  /// damping, where the equilibrium follows the number: {name: dJ/dp of each spring or interaction}, by one adjoint solve. `slope` is dJ/dx, (N, d),
  /// whole. Numbers of interactions whose law has no derivative by them are left out. Histories are held fixed. Errors: there is no equilibrium, or
  /// numbers were changed since it was found (Exit::input); those of find_adjoint() (tasks/sensitivities.hpp).
  Error sensitivities(const std::vector<double>& slope, std::map<std::string, std::vector<double>>* out);
  Error moduli(Result* out, const Settings& more = {});
  /// `count`: by default that of -bs_modes. `about`, unless null: an equilibrium from a result of solve_statics() or follow(), of a session of the
  /// same lattice and settings on any number of ranks. The modes are then about it, as with -bs_modes_about equilibrium but without a new search.
  Error modes(std::optional<std::int64_t> count, Result* out, const Settings& more = {}, const SavedState* about = nullptr);

  /// Local. Time [s] and number of steps of the last good state.
  double time() const;
  std::int64_t steps() const;
  /// Number of particles of the whole lattice, and this rank's rows [first, first + count) of the input; known once the system is made.
  Rows particles() const;
  int dim() const;

  /// Arrays over the particles at the last good state, (N, d), in the order of the input. reaction: the forces of supports and given motions on held
  /// particles.
  enum class Array { position, velocity, force, reaction };
  /// The array of all particles, on every rank.
  Error get(Array what, std::vector<double>* all);
  /// This rank's rows of the array.
  Error get_rows(Array what, std::vector<double>* rows);
  /// An array in the memory of the state: component c of row i is first[i * stride + c].
  struct View {
    const double* first = nullptr;
    std::int64_t rows = 0, stride = 0;
    std::shared_ptr<const void> memory;  ///< keeps the memory alive, also after the end of the session
  };
  /// Positions or velocities without a copy. The view follows steps and states that are set or restored, until set_numbers() makes the system anew
  /// (expect_changes()); within a step it may show an attempt. Error (Exit::input): the memory is not in the order of the input, because particles
  /// are on several ranks or reordered (-bs_ordering), or because groups are held or move as given.
  Error view(Array what, View* out);
  /// Replaces positions or velocities of this rank's rows in the last good state; the method then starts anew from there, without a history.
  /// Particles that are held or move as given stay where they are. Error (Exit::input): numbers that are not finite, or settings that name files of
  /// the run.
  Error set_rows(Array what, const std::vector<double>& rows);
  /// Changes numbers of the lattice that the session was created with: all values of one name, in the order of the input, the same on every rank.
  /// Names: stiffness, rest_length, damping and the parameters of the springs' laws; mass; angle_stiffness, angle_rest_angle, hinge_stiffness,
  /// hinge_rest_angle. They hold for the system that is stepped, which continues as after set_rows(), for follow(), and for later analyses. Errors
  /// (Exit::input): those of change_numbers() (lattice/lattice.hpp); a session without a lattice in memory.
  Error set_numbers(const std::string& name, const std::vector<double>& all);
  /// Systems made from now on (Make::when_needed) reserve matrix entries for springs that exert nothing yet, so that follow() still works after
  /// set_numbers() has given them a stiffness; without these entries there is then no equilibrium to follow. The system that is stepped is made anew
  /// where it lacks them.
  void expect_changes();
  /// Local. The present numbers of that name; empty where there are none.
  std::vector<double> numbers(const std::string& name) const;
  /// Removes springs, given by rows of the input: they exert and damp nothing any more, whatever set_numbers() is given (their numbers become 0 where
  /// 0 is allowed). restore() of an earlier state brings them back.
  Error remove_springs(const std::vector<std::int64_t>& rows);
  /// Moves a group whose motion is given by the caller (-bs_motion_NAME given) uniformly from its present place to that in `rows`, which it reaches
  /// at the later time t [s]; it then stays there until the next call. `rows` are this rank's rows as in set_rows(), of which only those of the group
  /// are read.
  Error drive(const std::string& group, double t, const std::vector<double>& rows);
  /// Everything that determines how the system goes on from the last good state: positions and velocities, histories of springs and broken parts,
  /// works, the time, given motions, changed numbers and removed springs, and what the method remembers of earlier steps.
  struct State : SavedState {
    std::int64_t steps = 0;
    std::int64_t number = 0;    ///< its place among the states that its session has saved
    std::uint64_t made_of = 0;  ///< fingerprint of the system as it was made
    SavedState::Parts shown;    ///< the state in which held particles are at their present places
    /// A motion given by the caller: the state in which held particles are at their places at the beginning and at the end of the motion.
    struct Way {
      std::string group;
      double from = 0, to = 0;
      SavedState::Parts there_from, there_to;
    };
    std::vector<Way> ways;
    std::shared_ptr<const KeptCheckpoint> run;
    NumberTable changed;             ///< numbers that were changed since the system was made
    std::set<std::int64_t> removed;  ///< rows of removed springs
  };
  Error save(std::shared_ptr<const State>* out);
  /// Returns to a state of this session, or of another one of the same lattice and laws on as many ranks. The steps that follow are those that
  /// followed save(), to the last digit, as after a restart from a file; where the settings name another method or step, the method starts anew.
  /// Errors (Exit::input), which change nothing: a state of another system, or not the same on all ranks; settings that name files of the run.
  Error restore(const State& state);
  /// To be called before the first step, in a session whose lattice has the positions of `equilibrium`: takes over its histories of springs and
  /// broken parts. It may be of a session on any number of ranks. Works and times begin anew.
  Error inherit(const SavedState& equilibrium);
  /// PETSc's TS of the motion, with its SNES, KSP, state and matrices, for inspection between steps. The session owns it and gives it up at its end,
  /// or when it continues from a state that is set or restored. A caller with a reference of its own may inspect it after that; calls that would
  /// compute then return an error of PETSc's.
  Error stepper(TS* ts);
  /// The same for the load steps by which solve_statics() or follow() found the last equilibrium; valid until the next analysis. Error (Exit::input):
  /// there is no equilibrium.
  Error load_stepper(TS* ts);
  /// The contents of a frame of the trajectory at this moment, whole on every rank: observables, and fields that the settings ask for
  /// (-bs_output_springs). Within an observer of load steps, those of the present equilibrium.
  Error get_frame(FrameData* out);

  /// Observers, called on every rank: on_step's after every successful step, also load steps of analyses, on_frame's at every output time
  /// (-bs_output_interval; the start and the end always are output times). They may ask for arrays, but not take steps.
  void on_step(std::function<void(const StepRecord&)> observer);
  void on_frame(std::function<void(double time)> observer);
  /// To be called by an observer, on all ranks: the call that takes steps returns after the present one, without an error. The next call continues;
  /// load steps end with the present equilibrium.
  void pause();
  /// Writes the last good state as a checkpoint, from which a session of the same lattice can continue by -bs_restart; replaces a file of that name.
  Error checkpoint(const std::string& file);

  /// `poll` is called on every rank between steps, also by analyses. Where it returns a number other than 0 on some rank, the call ends on all with
  /// an Error of that number plus 128; the last good state is kept.
  void on_poll(std::function<int()> poll);

  /// Adds forces to those of the settings, in all systems that are made from now on (Make::when_needed), with a tangent and a potential where
  /// `forces` has them.
  void on_force(ForceCallback forces);

  /// Local. The warnings so far; on the first rank.
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
