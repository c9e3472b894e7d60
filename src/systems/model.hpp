// The interface between the systems that are integrated (first-order form F(t, y, y') = 0) and the methods (solvers/, time/). A model does not depend
// on TS types; the callbacks of TS are thin wrappers around these methods.
#pragma once
#include <petscksp.h>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>
#include "linalg/condensed/tangent.hpp"
#include "systems/incremental.hpp"
#include "systems/system.hpp"

namespace bs {

class Mechanics;

/// The form of the residual that an implicit TS type needs.
enum class Form {
  momentum,  ///< F_x = M (x' - v), F_v = M v' - f(t, x, v); keeps the v-block symmetric
  velocity   ///< F_x = x' - v, F_v = v' - M^-1 f; for types that need F = y' - G, arkimex among them
};

using ResidualNorms = std::array<double, 2>;

/// What a run requires of a model.
struct Plan {
  bool implicit = true;
  Form form = Form::momentum;
  double step = 0;   ///< nominal step length [s]
  double steps = 0;  ///< about how many steps the run will take
  std::vector<double> polynomial =
      {};                  ///< explicit types: R(z), a step takes x' = lambda x to R(h lambda) x; coefficients of 1, z, ...; empty: not checked
  std::string type = {};   ///< the TS type's name
  std::string method;      ///< the options that choose the method
  bool descriptor = true;  ///< whether the method keeps its order where C is singular
  bool adaptive = false;   ///< whether an error estimate chooses the steps
  bool any_step = true;    ///< whether the method is stable at any step length: explicit types and theta below 1/2 are not
};

/// A system of differential equations F(t, y, y') = 0 with its explicit form y' = G(t, y).
class Model : public System {
 public:
  virtual PetscErrorCode residual(double t, Vec y, Vec ydot, Form form, Vec F) = 0;
  /// Fills P with J = sigma dF/dy' + dF/dy and assembles it.
  virtual PetscErrorCode jacobian(double t, Vec y, Vec ydot, double sigma, Form form, Mat P) = 0;
  /// From now on J uses `ratio` sigma in place of sigma in its rows of v, as second-order methods need; only models of positions and velocities have
  /// this.
  virtual void set_inertia(double) {}
  /// G(t, y) of the explicit form.
  virtual PetscErrorCode rhs(double t, Vec y, Vec G) = 0;
  /// Creates a matrix with the full pattern of J, assembled with explicit zeros, of the type that -mat_type asks for.
  virtual PetscErrorCode create_matrix(Mat* P) = 0;
  /// Creates the operator that belongs to P: P itself (with a new reference), or P plus the terms that cannot be assembled.
  virtual PetscErrorCode create_operator(Mat P, Form form, Mat* A) = 0;

  /// The second-order system M x'' = f whose state is y = (x, v); null: the model has none.
  virtual Mechanics* mechanics() { return nullptr; }
  /// Moves that system out, so that another model can be made of it; this model cannot be used afterwards.
  virtual std::unique_ptr<Mechanics> take_mechanics();
  /// What a condensed solve needs, renewed by every jacobian(); null: the model has no such form.
  virtual Tangent* tangent() { return nullptr; }
  /// What the energy-based line search needs; null: the model has no such potential.
  virtual Incremental* incremental() { return nullptr; }
  /// The same where forces limit how far a state may go at once, else null.
  Incremental* limits() { return incremental() && incremental()->limits_steps() ? incremental() : nullptr; }
  /// Creates a matrix that multiplies by J without storing it, to be passed to jacobian() in place of an assembled one; only models with a tangent
  /// have this.
  virtual PetscErrorCode create_shell(Mat*) { return 0; }

  /// 2-norms of the two parts of a residual that are judged separately (kinematic [kg m/s], momentum [N]); a model with one kind of equation leaves
  /// the second 0.
  virtual PetscErrorCode residual_norms(Vec F, ResidualNorms* norms) = 0;
  /// The same norms of the rounding errors in the residual near y: no Newton iteration can reduce the residual below them.
  virtual PetscErrorCode residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) = 0;

  /// Collective. The largest error of velocity in a single particle that the residual F at y corresponds to, beyond the particle's rounding errors,
  /// and the largest speed [m/s]. The 2-norm over all particles cannot see the error of a light part beside a heavy or stiff one. sigma is 1/h.
  /// Models without particles leave both 0.
  virtual PetscErrorCode velocity_errors(Vec, Vec, double, Form, double* worst, double* fastest) {
    *worst = *fastest = 0;
    return 0;
  }

  /// Whether F is linear in y and y': one linear solve a step is then enough.
  virtual bool linear() const { return false; }
  /// How many steps are to be taken by backward Euler at the start, and after what stopped the method's memory (types of the theta family).
  virtual std::int64_t startup_steps() const { return 0; }
  /// Collective. A new vector of states, 1 where a state's derivative occurs, else 0; null where all derivatives do. The others follow from them and
  /// from the time: error control leaves them out.
  virtual PetscErrorCode mark_differential(Vec* marks) {
    *marks = nullptr;
    return 0;
  }
  /// Collective. What to change where no step from t [s] on is accepted; empty: what the method says.
  virtual PetscErrorCode advice(double, std::string* text) {
    text->clear();
    return 0;
  }
  /// Collective, after the first set-up of the linear solver: ends the run where its matrix, null if it has none, is singular.
  virtual PetscErrorCode check_solver(KSP) { return 0; }
};

}  // namespace bs
