// What every system that is integrated in time provides for output, checkpoints and headers, whatever its equations: for output/, checkpoint/
// and the header of a run.
#pragma once
#include <petscvec.h>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>
#include "base/facts.hpp"
#include "base/knots.hpp"
#include "lattice/columns.hpp"

namespace bs {

struct Plan;  // systems/model.hpp

/// A step that is done: it ended at time t after the length h, [s] or of the load factor; or one that begins: it is to go from t by h. `number`
/// counts from 1 on, 0: the start; `attempt`: how many attempts of it were rejected before.
struct Step {
  PetscReal t = 0, h = 0;
  PetscInt number = 0, attempt = 0;
};

/// A named quantity of one moment: one row of a frame.
struct Observable {
  std::string name;           ///< e.g. "kinetic_energy"
  std::vector<double> value;  ///< the same on every rank; length 1 is written as a scalar
  int columns = 0;            ///< of a matrix written row by row as such; 0: it is none
  Powers powers = {};         ///< of its unit, where the name does not say it
};

/// Name of the observable that holds the edges of a periodic box: its group in the trajectory.
inline const char* const BOX_EDGES = "/particles/trajectory/box/edges";

/// Puts this rank's rows [first, first + count) behind one another to `to`. Not collective.
using RowSource = std::function<PetscErrorCode(PetscInt first, PetscInt count, double* to)>;

/// A vector that is written with every frame, in the input's order: block size = columns.
struct Field {
  std::string group;      ///< absolute path of the HDF5 group, e.g. "/particles/trajectory/position"
  Vec vec;                ///< global Vec, block size d, rows in the input's order; borrowed
  bool flat = false;      ///< block size 1 written as (T, N), not (T, N, 1)
  RowSource source = {};  ///< where set, the rows come from here, and `vec` tells sizes alone; on one rank only
  bool gaps = false;      ///< NaN stands where there is no such quantity
  bool drawing = false;   ///< whole numbers that viewers alone need: written in 4 bytes, where there is a sidecar that names them
  Powers powers = {};     ///< of its unit, where the name does not say it
};

/// Strings of one length (the same on every rank), padded with zeros, one behind the other.
struct Words {
  std::size_t width = 1;
  std::string text;
};

/// Data written once: this rank's rows [first, first + rows) of a table of `total` rows and `columns` columns
/// (columns = 0: a one-dimensional dataset).
struct Dataset {
  std::string path;
  std::int64_t first = 0, total = 0;
  int columns = 0;
  std::variant<std::vector<double>, std::vector<std::int64_t>, Words> rows;
  std::vector<std::pair<std::string, std::string>> attributes = {};  ///< texts by name
  Powers powers = {};                                                ///< of its unit, where the name does not say it
  bool gaps = false;                                                 ///< NaN stands where there is no such number, infinity where there is no limit
};

/// A part of the state in the input's order: block size = columns, rows as in the input; borrowed.
struct StatePart {
  std::string name;  ///< of a dataset
  Vec vec;
};

/// The energies of one moment, and what feeds them. `inner` can grow only by what `field` loses and the rest supplies.
struct EnergySupply {
  double inner = 0;                        ///< kinetic and elastic [J]
  double field = 0;                        ///< potential of outer fields [J]
  double power = 0;                        ///< sizes of the power of outer fields, couplings and the fluid's motion, added up [W]
  double pull = 0;                         ///< size of the force of driven anchors on the particles [N]
  double shift[3] = {0, 0, 0}, speed = 0;  ///< of the driven anchors: displacement [m], size of its velocity [m/s]
  double work = 0;                         ///< of driven particles since the run began, sizes of every step's, added up [J]
  double rounding = 0;                     ///< energy that rounding errors alone may produce [J]
};

/// Something a model counted, for the summary and the report.
struct Tally {
  std::string key, text;  ///< name in the report; words of the summary (how_many); no text: in the report alone
  std::int64_t count = 0;
  std::string unknown = {};  ///< why it was not counted, for the summary; the report has null. Empty: it was
};

/// Parts of a system that break at accepted states: for time stepping, load steps and the trajectory.
class Breaks {
 public:
  virtual ~Breaks() = default;
  /// How many parts the last System::accept() broke: forces are others than before. The same on every rank.
  virtual std::int64_t broke() const = 0;
  /// Whether any part is broken.
  virtual bool any() const = 0;
  /// Before a step is accepted that may be taken back.
  virtual void mark() = 0;
  /// Parts that broke since mark() are whole again, with their histories of then; sums are given back by System::restore_sums().
  virtual void revert() = 0;
  /// Books a step of motion at constant load [s]; `motion`, `motion_steps`: all of them.
  virtual void add_motion(double seconds) = 0;
  virtual double motion() const = 0;
  virtual std::int64_t motion_steps() const = 0;
  /// Collective. The list of what broke, for the end of a trajectory.
  virtual PetscErrorCode tables(std::vector<Dataset>* out) const = 0;
};

class System {
 public:
  virtual ~System() = default;
  /// What of it breaks; null: nothing.
  virtual Breaks* breaks() { return nullptr; }
  virtual const char* name() const = 0;
  /// Space dimension of its particles; 0: it has none.
  virtual int dim() const { return 0; }
  /// "periodic" or "none" along each edge of the box of its particles; empty: there is none.
  virtual std::vector<std::string> boundary() const { return {}; }
  virtual MPI_Comm comm() const = 0;
  /// The state at the start; borrowed.
  virtual Vec initial_state() const = 0;
  /// Lines of the header: what system, how many, which laws.
  virtual std::vector<std::string> describe() const = 0;
  /// Whether its forces or sources depend on t otherwise than through the state.
  virtual bool time_dependent() const { return false; }
  /// The first time in (from, to] at which what is given over time is seen to jump or bend, the same on every rank; a later one counts as none.
  virtual Knot next_knot(double, double) { return {}; }
  /// From now on what is given has these sides at its knots.
  virtual void set_sides(const Sides&) {}
  virtual std::vector<Tally> tallies() const { return {}; }

  /// Whether forces may be others in every step, by begin_step().
  virtual bool begins_steps() const { return false; }
  /// Collective. An attempt at the step begins, from y; only where begins_steps().
  virtual PetscErrorCode begin_step(const Step&, Vec) { return 0; }
  /// Collective. The step, which has ended in y, is accepted: quantities that depend on the past are updated to it. Evaluations never change them.
  virtual PetscErrorCode accept(const Step&, Vec) { return 0; }
  /// Collective. What the system carries from step to step besides y, in the input's order, for a checkpoint: vectors the
  /// system owns, filled; and back. Empty: nothing.
  virtual PetscErrorCode gather_memory(std::vector<StatePart>* parts) {
    parts->clear();
    return 0;
  }
  virtual PetscErrorCode scatter_memory() { return 0; }
  /// Whether forces at a state depend on what accept() has made of it.
  virtual bool remembers() const { return false; }

  /// Sums over the run so far, by name, the same on every rank, for a checkpoint; and back: those that it holds.
  void save_sums(std::map<std::string, double>* sums) { keep_sums(Keeper(sums)); }
  void restore_sums(const std::map<std::string, double>& sums) { keep_sums(Keeper(sums)); }
  virtual void keep_sums(const Keeper&) {}

  virtual PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) = 0;
  /// Collective. False: the system has no such energies.
  virtual PetscErrorCode energy_supply(double, Vec, EnergySupply*, bool* has) {
    *has = false;
    return 0;
  }
  /// Fields of the frame, filled from y.
  virtual PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) = 0;
  /// Collective. The state y in the input's order, bit by bit: vectors the system owns, filled from y; and back.
  virtual PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) = 0;
  virtual PetscErrorCode scatter_state(Vec y) = 0;
  /// Collective. A number that identifies this system: the same on any number of ranks, and it differs when a
  /// particle, spring or matrix entry changes. Forces set by options, which a run may change, are not included.
  virtual PetscErrorCode fingerprint(std::uint64_t* value) = 0;
  /// Collective. Data written once per trajectory, moved out of the system, which no longer holds them.
  virtual PetscErrorCode take_constants(std::vector<Dataset>* out) = 0;
  /// Frees what was kept of the input for take_constants().
  virtual void release_input() {}
  /// Collective, once, before the first step in time. Ends the run with exit code 2 if the system does not have the form that the method requires.
  virtual PetscErrorCode prepare(const Plan&) { return 0; }
  /// Collective. Ends the run with exit code 2 if data given over time (tables) do not extend to t_end, or what moves as given is seen to jump.
  virtual PetscErrorCode covers(double t_start, double t_end) = 0;
  /// Collective. Why no state can follow what is given over the time from `from` to `to`: it is not finite at the end of it, or jumps on the way
  /// there, or leaves a box without volume; empty: it can. `from` == `to`: at that time alone.
  virtual PetscErrorCode foresee(double, double, std::string* fault) {
    fault->clear();
    return 0;
  }
  /// Collective. The fault met in the last evaluation on any rank (a spring of zero length, ...); empty if none.
  virtual PetscErrorCode last_fault(std::string* text) = 0;
};

}  // namespace bs
