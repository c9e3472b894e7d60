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
  double step = 0;   ///< nominal [s]
  double steps = 0;  ///< about how many there will be
  std::vector<double> polynomial =
      {};                  ///< explicit types: R(z), a step takes x' = lambda x to R(h lambda) x; coefficients of 1, z, ...; empty: not checked
  std::string type = {};   ///< the TS type's name
  std::string method;      ///< the options that name the method
  bool descriptor = true;  ///< whether it keeps its order where C is singular
  /// Whether the steps on both sides of a time count alike what is given there: sources and forces that jump then have the mean of both sides, by
  /// which the method keeps its order 2.
  bool even_ends = false;
  bool any_step = true;  ///< whether it is stable at any step: explicit types and theta below 1/2 are not
};

/// A system of differential equations F(t, y, y') = 0 with its explicit form y' = G(t, y).
class Model : public System {
 public:
  virtual PetscErrorCode residual(double t, Vec y, Vec ydot, Form form, Vec F) = 0;
  /// J = sigma dF/dy' + dF/dy into P (assembled).
  virtual PetscErrorCode jacobian(double t, Vec y, Vec ydot, double sigma, Form form, Mat P) = 0;
  /// From now on J has `ratio` sigma for sigma in its rows of v, as second-order methods need; models of positions and velocities only.
  virtual void set_inertia(double) {}
  /// G(t, y) of the explicit form.
  virtual PetscErrorCode rhs(double t, Vec y, Vec G) = 0;
  /// A matrix with the full pattern of J, assembled (explicit zeros included), of the type -mat_type asks for.
  virtual PetscErrorCode create_matrix(Mat* P) = 0;
  /// The operator that goes with P: P itself (referenced), or P plus what cannot be assembled.
  virtual PetscErrorCode create_operator(Mat P, Form form, Mat* A) = 0;

  /// The second-order system M x'' = f behind a state y = (x, v); null: there is none.
  virtual Mechanics* mechanics() { return nullptr; }
  /// Takes it out, for another model to be made of it; this one is of no use afterwards.
  virtual std::unique_ptr<Mechanics> take_mechanics();
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
  /// The same norms of the rounding errors in the residual near y: no Newton iteration can reduce the residual below them.
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
  /// Steps at the start that are to be taken by backward Euler (types of the theta family).
  virtual std::int64_t startup_steps() const { return 0; }
  /// Collective, after the first set-up of the linear solver: ends the run where its matrix is singular. Null: it has no matrix.
  virtual PetscErrorCode check_solver(KSP) { return 0; }
};

}  // namespace bs
