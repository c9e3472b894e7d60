// The one interface between what is advanced (particles, linear systems) and how (solve/), and to what is written
// (output/). A model knows nothing of TS types; callbacks of TS are thin wrappers around these methods.
#pragma once
#include <petscts.h>
#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

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
};

/// Data written once: this rank's rows [first, first + rows) of a table of `total` rows and `columns` columns
/// (columns = 0: a one-dimensional dataset).
struct Dataset {
  std::string path;
  std::int64_t first = 0, total = 0;
  int columns = 0;
  std::variant<std::vector<double>, std::vector<std::int64_t>> rows;
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

  /// 2-norms of the parts of a residual that are judged apart (kinematic [kg m/s], momentum [N]); a model of one kind
  /// leaves the second 0.
  virtual PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) = 0;
  /// The same norms of the rounding errors in the residual near y: below them no Newton iteration can get.
  virtual PetscErrorCode residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) = 0;

  virtual PetscErrorCode observe(double t, Vec y, std::vector<Observable>* out) = 0;
  /// Fields of the frame, filled from y.
  virtual PetscErrorCode fields(double t, Vec y, std::vector<Field>* out) = 0;
  /// Data written once per trajectory.
  virtual PetscErrorCode constants(std::vector<Dataset>* out) = 0;
  /// Collective. Data given over time (tables) must reach to t_end: told (exit 2) if they do not.
  virtual PetscErrorCode covers(double t_end) = 0;
  /// Collective. The fault met in the last evaluation on any rank (a spring of zero length, ...); empty if none.
  virtual PetscErrorCode last_fault(std::string* text) = 0;
};

}  // namespace bs
