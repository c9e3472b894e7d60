// The initial guess of Newton's method: at the last state, at the state the last two velocities point to where that is closer, or where a motion
// downhill in the step's potential ends.
#pragma once
#include <petscts.h>
#include <vector>
#include "base/handle.hpp"
#include "solvers/newton/convergence.hpp"
#include "systems/model.hpp"
#include "time/history.hpp"
#include "time/implicit/substep_guess.hpp"

namespace bs {

/// For the one-step types beuler, cn and theta with end point. With v the velocity and theta the type's:
///   v* = v_n + (v_n - v_(n-1)) h/h_(n-1),  x* = x_n + h ((1 - theta) v_n + theta v*)
/// It is taken if its residual is less than half that at (x_n, v_n): through stiff springs it is far larger. After a step that met a tangent that was
/// not positive definite SubstepGuess takes its place (-bs_guess). Where forces do not allow to go there at once, it is (x_n, v_n).
class Predictor {
 public:
  /// Collective. Reads its options and hooks into the SNES of `ts` where the type is one of those and the model has positions and velocities.
  PetscErrorCode attach(TS ts, Model& model, NewtonPolicy* newton);
  /// Where the state before the last comes from; without it Newton starts at the last state.
  void set_history(const History* history) { history_ = history; }
  std::int64_t substeps() const { return substeps_.taken(); }
  /// Whether all ways to the end of a step go by what forces allow (Incremental::largest_lambda): the first iterate and the line search.
  bool within_limits() const { return within_limits_; }
  /// Not collective. What a checkpoint holds of it: whether the last step met a tangent that was not positive definite; and back.
  PetscErrorCode save(Facts* facts) const;
  PetscErrorCode restore(const Facts& facts);

 private:
  enum class Guess { automatic, extrapolate, substeps };
  PetscErrorCode read_options(TS ts, PetscInt* most);
  PetscErrorCode predict(SNES snes, Vec X);
  PetscErrorCode extrapolate(SNES snes, Vec y, Vec X);
  PetscErrorCode descend(SNES snes, Vec y, Vec X);
  PetscErrorCode residual_at(SNES snes, Vec X, ResidualNorms* norms);
  /// Collective. Whether forces allow to go from y to X at once.
  PetscErrorCode may_go(SNES snes, Vec y, Vec X, bool* yes);
  PetscErrorCode count_indefinite(PetscInt* count) const;
  PetscErrorCode wants_substeps(bool* yes);
  TS ts_ = nullptr;
  Model* model_ = nullptr;
  NewtonPolicy* newton_ = nullptr;
  const History* history_ = nullptr;
  double theta_ = 1;
  Guess guess_ = Guess::automatic;
  bool within_limits_ = false;
  SubstepGuess substeps_;
  bool folded_ = false;      ///< the step before the restart met negative curvature
  PetscInt indefinite_ = 0;  ///< tangents that were not positive definite, before the last attempt
};

// Additions to PETSc's rosw: the time derivative of F in every stage, and one Jacobian for all stages of a step.

/// A Rosenbrock step with J at (t_n, y_n) solves in every stage, u_i its unknown,
///   F(t_n + alpha_i h, y_i + u_i, sigma u_i + ...) + gamma_i h dF/dt(t_n, y_n) = 0,   gamma_i = sum_j gamma_ij,
/// as it would with t a further unknown of an autonomous system. PETSc leaves the last term out, without which most
/// subtypes fall to order 1 where F depends on t. Methods of types other than rosw do nothing.
class RosenbrockStages {
 public:
  /// Collective. `ts` has its type and subtype. Does nothing for other types than rosw.
  PetscErrorCode attach(TS ts, Model& model, Form form);
  bool active() const { return active_; }
  /// Whether a stage is explicit: it multiplies by the Jacobian's matrix, which must be there.
  bool has_explicit_stage() const { return explicit_; }
  /// Whether the Jacobian is evaluated at more than the first stage.
  bool has_own_matrices() const { return explicit_ || uneven_; }
  /// Whether a stage lies before the step.
  bool has_stage_before() const { return stage_before_; }
  /// Brings *t into the present step.
  static PetscErrorCode limit_time(TS ts, PetscReal* t);
  /// Before each stage.
  PetscErrorCode before_stage(TS ts);
  /// Adds the term of the present stage to F.
  PetscErrorCode add_time_term(TS ts, Vec F);

 private:
  PetscErrorCode probe(const char* subtype);
  PetscErrorCode differentiate(TS ts);

  Model* model_ = nullptr;
  Form form_ = Form::momentum;
  bool active_ = false, explicit_ = false;
  bool uneven_ = false;  ///< gamma_ii, and with it the shift sigma, differs from stage to stage
  bool stage_before_ = false;
  bool fresh_ = false;         ///< rate_ is that of this attempt
  std::vector<double> gamma_;  ///< gamma_i
  std::size_t stage_ = 0;
  PetscInt step_ = -1, rejected_ = -1;  ///< of the attempt under way
  VecHandle rate_, still_, trial_[5];   ///< dF/dt; y' = 0; F at five times
};

}  // namespace bs
