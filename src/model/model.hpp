// The one interface between what is advanced (particles, linear systems) and how (solve/), and to what is written
// (output/). A model knows nothing of TS types; callbacks of TS are thin wrappers around these methods.
#pragma once
#include <petscts.h>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>
#include "model/incremental.hpp"
#include "model/tangent.hpp"

namespace bs {

/// How an implicit TS type wants the residual.
enum class Form {
  momentum,  ///< F_x = M (x' - v), F_v = M v' - f(t, x, v); keeps the v-block symmetric
  velocity   ///< F_x = x' - v, F_v = v' - M^-1 f; for types that need F = y' - G, arkimex among them
};

using ResidualNorms = std::array<double, 2>;

/// A named quantity of one moment: one row of a frame.
struct Observable {
  std::string name;            ///< e.g. "kinetic_energy"
  std::vector<double> value;   ///< the same on every rank; length 1 is written as a scalar
};

/// A vector that is written with every frame, in the input's order: block size = columns.
struct Field {
  std::string group;  ///< absolute path of the HDF5 group, e.g. "/particles/trajectory/position"
  Vec vec;            ///< global Vec, block size d, rows in the input's order; borrowed
  bool flat = false;  ///< block size 1 written as (T, N), not (T, N, 1)
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
};

/// A part of the state in the input's order: block size = columns, rows as in the input; borrowed.
struct StatePart {
  std::string name;  ///< of a dataset
  Vec vec;
};

/// The energies of one moment, and what feeds them. `inner` can grow only by what `field` loses and the rest supplies.
struct EnergySupply {
  double inner = 0;       ///< kinetic and elastic [J]
  double field = 0;       ///< potential of outer fields [J]
  double power = 0;       ///< sizes of the power of outer fields, couplings and the fluid's motion, added up [W]
  double pull = 0;        ///< size of the force of driven anchors on the particles [N]
  double shift[3] = {0, 0, 0}, speed = 0;  ///< of the driven anchors: displacement [m], size of its velocity [m/s]
  double rounding = 0;    ///< what rounding alone may make of nothing [J]
};

/// What the run will ask of a model.
struct Plan {
  bool implicit = true;
  Form form = Form::momentum;
  double step = 0;           ///< nominal [s]
  double real_stability = 0; ///< largest |h lambda| an explicit type bears for lambda < 0; 0: not looked at
  std::string type = {};     ///< the TS type's name
  std::string method;        ///< the options that name the method
  bool descriptor = true;    ///< whether it keeps its order where C is singular
};

/// Something a model counted, for the summary and the report.
struct Tally {
  std::string key, text;     ///< name in the report; words of the summary after the number; no text: in the report alone
  std::int64_t count = 0;
};

/// A system of differential equations F(t, y, y') = 0 with its explicit form y' = G(t, y).
class Model {
 public:
  virtual ~Model() = default;
  virtual const char* name() const = 0;
  /// Space dimension of its particles; 0: it has none.
  virtual int dim() const { return 0; }
  virtual MPI_Comm comm() const = 0;
  /// The state at the start; borrowed.
  virtual Vec initial_state() const = 0;
  /// Lines of the header: what system, how many, which laws.
  virtual std::vector<std::string> describe() const = 0;

  virtual PetscErrorCode residual(double t, Vec y, Vec ydot, Form form, Vec F) = 0;
  /// J = sigma dF/dy' + dF/dy into P (assembled).
  virtual PetscErrorCode jacobian(double t, Vec y, Vec ydot, double sigma, Form form, Mat P) = 0;
  /// G(t, y) of the explicit form.
  virtual PetscErrorCode rhs(double t, Vec y, Vec G) = 0;
  /// A matrix with the full pattern of J, assembled (explicit zeros included), of the type -mat_type asks for.
  virtual PetscErrorCode create_matrix(Mat* P) = 0;
  /// The operator that goes with P: P itself (referenced), or P plus what cannot be assembled.
  virtual PetscErrorCode create_operator(Mat P, Form form, Mat* A) = 0;

  /// What a condensed solve needs, renewed by every jacobian(); null: the model has no such form.
  virtual Tangent* tangent() { return nullptr; }
  /// What the energy-based line search needs; null: the model has no such potential.
  virtual Incremental* incremental() { return nullptr; }
  /// A matrix that multiplies by J without holding it, to be given to jacobian() in place of an assembled one; models with
  /// a tangent only.
  virtual PetscErrorCode create_shell(Mat*) { return 0; }

  /// 2-norms of the parts of a residual that are judged apart (kinematic [kg m/s], momentum [N]); a model of one kind
  /// leaves the second 0.
  virtual PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) = 0;
  /// The same norms of the rounding errors in the residual near y: below them no Newton iteration can get.
  virtual PetscErrorCode residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) = 0;

  /// Collective. The largest velocity error that F stands for in one particle alone, beyond its own rounding errors, and the
  /// largest speed [m/s]: a 2-norm over everything does not see a light part beside a heavy or a stiff one. F is the
  /// residual at y, sigma 1/h. Models without particles leave both 0.
  virtual PetscErrorCode velocity_errors(Vec, Vec, double, Form, double* worst, double* fastest) {
    *worst = *fastest = 0;
    return 0;
  }

  /// Whether F is linear in y and y': one linear solve a step is then enough.
  virtual bool linear() const { return false; }
  /// Whether F depends on t otherwise than through y.
  virtual bool time_dependent() const { return false; }
  /// Collective, once, before the first evaluation. Told (exit 2) if the model has not got the form asked for.
  virtual PetscErrorCode prepare(const Plan&) { return 0; }
  /// Steps at the start that are to be taken by backward Euler (types of the theta family).
  virtual std::int64_t startup_steps() const { return 0; }
  /// Collective, after the first set-up of the linear solver: told where its matrix is singular. Null: it has no matrix.
  virtual PetscErrorCode check_solver(KSP) { return 0; }
  virtual std::vector<Tally> tallies() const { return {}; }

  virtual PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) = 0;
  /// Collective. False: the model has no such energies.
  virtual PetscErrorCode energy_supply(double, Vec, EnergySupply*, bool* has) {
    *has = false;
    return 0;
  }
  /// Fields of the frame, filled from y.
  virtual PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) = 0;
  /// Collective. The state y in the input's order, bit by bit: vectors the model owns, filled from y; and back.
  virtual PetscErrorCode gather_state(Vec y, std::vector<StatePart>* parts) = 0;
  virtual PetscErrorCode scatter_state(Vec y) = 0;
  /// Collective. The state y at t is good and the next step begins with it: what the model carries from step to step, besides y,
  /// becomes that of y. No other call changes it, so that a rejected attempt leaves nothing behind.
  virtual PetscErrorCode accept(double, Vec) { return 0; }
  /// Collective. What the model carries so, in the input's order, for a checkpoint: vectors the model owns, filled; and back. Empty:
  /// nothing.
  virtual PetscErrorCode gather_memory(std::vector<StatePart>* parts) {
    parts->clear();
    return 0;
  }
  virtual PetscErrorCode scatter_memory() { return 0; }
  /// Collective. A number that tells this system from others: the same on any number of ranks, another one when a
  /// particle, spring or matrix entry changes. Forces that options name, which a run may change, do not count.
  virtual PetscErrorCode fingerprint(std::uint64_t* value) = 0;
  /// Data written once per trajectory.
  virtual PetscErrorCode constants(std::vector<Dataset>* out) = 0;
  /// Collective. Data given over time (tables) must reach to t_end: told (exit 2) if they do not.
  virtual PetscErrorCode covers(double t_end) = 0;
  /// Collective. The fault met in the last evaluation on any rank (a spring of zero length, ...); empty if none.
  virtual PetscErrorCode last_fault(std::string* text) = 0;
};

}  // namespace bs
