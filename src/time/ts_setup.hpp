// A TS for a model: type, form of the equations, callbacks and the program's own defaults.
#pragma once
#include <functional>
#include <string>
#include "base/handle.hpp"
#include "solvers/newton/convergence.hpp"
#include "systems/model.hpp"
#include "time/implicit/predictor.hpp"
#include "time/methods.hpp"

namespace bs {

/// What a run has where the options leave it open; of load steps, in units of the load factor.
struct Pace {
  double step = 0.01, end = 1;  ///< -ts_dt, -ts_max_time [s]
  double rtol = 1e-8;           ///< -snes_rtol
};

/// What a task finds of a solve that calls itself converged.
struct StageCheck {
  bool good = true;
  std::string failure = {};  ///< why it is not
  bool hopeless = false;     ///< a shorter step would not mend it
};

/// What the callbacks of one TS need; must outlive it.
struct TSContext {
  Pace pace;
  Model* model = nullptr;
  Form form = Form::momentum;
  bool implicit = true;
  const Method* method = nullptr;  ///< set by create_ts
  RosenbrockStages rosenbrock;
  NewtonPolicy newton;
  Predictor predictor;
  MatHandle operator_, matrix;                                             ///< Amat and Pmat of implicit types
  std::function<PetscErrorCode(double time, Vec y, StageCheck*)> examine;  ///< collective, of every solve of a stage; empty: none is examined
};

/// Collective. Creates `ts` at the model's initial state; options override every default set here. An -ts_type that
/// cannot advance this model ends the run with exit code 2.
PetscErrorCode create_ts(Model& model, TSContext* context, TSHandle* ts);

/// Collective. The solver inside a condensed solve, if there is one, is created and reads its options.
PetscErrorCode create_inner_solver(TS ts, const TSContext& context);

/// One line on the solver in force: TS type, adaptivity, SNES, KSP, PC. `cut`: the length that output leaves of every step [s]; 0: all of it.
PetscErrorCode describe_solver(TS ts, const TSContext& context, double cut, std::string* line);

// Options that PETSc does not check (method_check.cpp): impossible numbers, and what does not go with a method. Reported before the first step.

/// Collective, after TSSetFromOptions. Ends the run with exit code 2 if an option would make the method crash, or silently lose its order
/// or its error control. A type without an error estimate keeps its step.
PetscErrorCode check_method(TS ts, const TSContext& context);

/// Collective, after TSSetFromOptions. Errors (exit 2): a step that is not positive, times that are not finite or end
/// before they begin, a negative number of steps, theta outside (0, 1].
PetscErrorCode check_stepping(TS ts);

// Tolerances of error-controlled steps, apart for positions and velocities, whose units differ.

struct Tolerances {
  double atol_x = 0, atol_v = 0;  ///< -bs_atol_x [m], -bs_atol_v [m/s]; 0: -ts_atol
  double rtol_x = 0, rtol_v = 0;  ///< -bs_rtol_x, -bs_rtol_v; 0: -ts_rtol
  bool given() const { return atol_x > 0 || atol_v > 0 || rtol_x > 0 || rtol_v > 0; }
};

/// Reads the options.
PetscErrorCode read_tolerances(MPI_Comm comm, Tolerances* out);

/// Collective. Applies them to `ts`, whose own tolerances are set; states without a derivative have none. Ends the run with exit code 2 for a model
/// without particles.
PetscErrorCode set_tolerances(const Tolerances& tolerances, Model& model, TS ts);

}  // namespace bs
