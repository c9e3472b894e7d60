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
struct Finding {
  bool good = true;
  std::string why = {};   ///< it is not
  bool hopeless = false;  ///< a shorter step would not mend it
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
  MatHandle operator_, matrix;                                          ///< Amat and Pmat of implicit types
  std::function<PetscErrorCode(double time, Vec y, Finding*)> examine;  ///< collective, of every solve of a stage; empty: none is examined
};

/// Collective. Creates `ts` at the model's initial state; options override every default set here. An -ts_type that
/// cannot advance this model ends the run with exit code 2.
PetscErrorCode create_ts(Model& model, TSContext* context, TSHandle* ts);

/// Collective. The solver inside a condensed solve, if there is one, is created and reads its options.
PetscErrorCode create_inner_solver(TS ts, const TSContext& context);

/// One line on the solver in force: TS type, adaptivity, SNES, KSP, PC.
PetscErrorCode describe_solver(TS ts, const TSContext& context, std::string* line);

}  // namespace bs
