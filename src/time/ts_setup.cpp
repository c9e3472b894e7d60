#include "time/ts_setup.hpp"
#include <algorithm>
#include <vector>
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/option_aliases.hpp"
#include "base/option_names.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/solver_options.hpp"
#include "solvers/newton/search/energy.hpp"
#include "time/implicit/solver_setup.hpp"
#include "time/methods.hpp"
#include "time/own_type.hpp"

namespace bs {
namespace {

PetscErrorCode form_residual(TS ts, PetscReal t, Vec y, Vec ydot, Vec F, void* data) {
  TSContext* context = static_cast<TSContext*>(data);
  PetscFunctionBegin;
  // where F does not depend on t, times before the run must not show (grk4t and its like look back)
  if (context->rosenbrock.has_stage_before()) PetscCall(context->rosenbrock.limit_time(ts, &t));
  context->newton.stage.residual_time = t;
  PetscCall(context->model->residual(t, y, ydot, context->form, F));
  if (context->rosenbrock.active()) PetscCall(context->rosenbrock.add_time_term(ts, F));
  PetscFunctionReturn(0);
}

PetscErrorCode form_jacobian(TS ts, PetscReal t, Vec y, Vec ydot, PetscReal sigma, Mat A, Mat P, void* data) {
  TSContext* context = static_cast<TSContext*>(data);
  PetscFunctionBegin;
  if (context->rosenbrock.active()) {  // all stages share the Jacobian of their step's start
    PetscCall(TSGetTime(ts, &t));
    PetscCall(TSGetSolution(ts, &y));
  }
  context->newton.stage.time = t;
  context->newton.stage.sigma = sigma;
  PetscCall(context->model->jacobian(t, y, ydot, sigma, context->form, P));
  if (A != P) {
    PetscCall(assemble(A));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode form_rhs(TS, PetscReal t, Vec y, Vec G, void* data) { return static_cast<TSContext*>(data)->model->rhs(t, y, G); }

PetscErrorCode no_rhs(TS, PetscReal, Vec, Vec G, void*) { return VecZeroEntries(G); }

/// TSSetFromOptions, whichever names its options have.
PetscErrorCode set_from_options(TS ts) {
  PetscFunctionBegin;
  PetscCall(with_names_of_petsc(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), [ts] { return TSSetFromOptions(ts); }));
  PetscFunctionReturn(0);
}

/// The method asked for and the form of F it needs. Ends the run with exit code 2 if there is none of that name.
PetscErrorCode choose_method(TS ts, const char* type, TSContext* context) {
  PetscFunctionBegin;
  PetscCall(asked_method(ts, type, &context->method));
  if (!context->method) PetscCall(set_from_options(ts));  // PETSc lists the subtypes it has
  if (!context->method)
    PetscFunctionReturn(fail(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), Exit::input,
                             format("option %s: a subtype this program does not know: options/reference lists those it does", subtype_option(type))));
  context->implicit = context->method->implicit();
  context->form = context->method->form;
  PetscFunctionReturn(0);
}

PetscErrorCode attempt_of(TS ts, NewtonStep* step) {
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &step->time));
  PetscCall(TSGetTimeStep(ts, &step->h));
  PetscCall(TSGetSolution(ts, &step->start));
  PetscFunctionReturn(0);
}

PetscErrorCode set_implicit(TS ts, Model& model, TSContext* context) {
  SNES snes;
  PetscFunctionBegin;
  bool assembled = true;
  PetscCall(needs_matrix(model, &assembled));
  PetscCall(assembled ? model.create_matrix(context->matrix.out()) : model.create_shell(context->matrix.out()));
  PetscCall(model.create_operator(context->matrix, context->form, context->operator_.out()));
  PetscCall(TSSetIFunction(ts, nullptr, form_residual, context));
  PetscCall(TSSetIJacobian(ts, context->operator_, context->matrix, form_jacobian, context));
  // without it PETSc starts each step, since 3.20, from the slope at the end of the one before, which no checkpoint has
  if (context->method->is(TSARKIMEX)) PetscCall(TSSetRHSFunction(ts, nullptr, no_rhs, nullptr));
  // its midpoint form would carry a violation of algebraic equations on for ever: a source's jump, for one
  if (model.linear() && context->method->is(TSTHETA)) PetscCall(TSThetaSetEndpoint(ts, PETSC_TRUE));
  PetscCall(TSGetSNES(ts, &snes));
  // Newton must earn its convergence by the residual, or by a whole step at rounding level; a line search that crawls
  // must not pass for it, as it would with PETSc's stol of 1e-8.
  PetscCall(SNESSetTolerances(snes, 0.0, context->pace.rtol, 1e-14, 50, PETSC_DEFAULT));
  NewtonSettings settings;
  settings.model = &model;
  settings.step = [ts](NewtonStep* step) { return attempt_of(ts, step); };
  settings.form = context->form;
  settings.affine = context->form == Form::momentum && context->method->traits->affine;
  PetscCall(context->newton.attach(snes, settings));
  PetscCall(set_linear_defaults(ts, model, &context->newton));
  PetscFunctionReturn(0);
}

}  // namespace

// Of a Runge-Kutta type: R(z) = 1 + sum of z^k b.A^(k-1) 1 over its stages, y_1 = R(h lambda) y_0 on y' = lambda y
static PetscErrorCode polynomial_of_tableau(TS ts, std::vector<double>* R) {
  PetscInt s;
  const PetscReal *A, *b;
  PetscFunctionBegin;
  PetscCall(TSRKGetTableau(ts, &s, &A, &b, nullptr, nullptr, nullptr, nullptr, nullptr));
  std::vector<double> stage(static_cast<std::size_t>(s), 1.0);
  *R = {1};
  for (PetscInt k = 0; k < s; ++k) {
    std::vector<double> next(stage.size(), 0.0);
    R->push_back(0);
    for (PetscInt i = 0; i < s; ++i) {
      R->back() += b[i] * stage[static_cast<std::size_t>(i)];
      for (PetscInt j = 0; j < s; ++j) next[static_cast<std::size_t>(i)] += A[i * s + j] * stage[static_cast<std::size_t>(j)];
    }
    stage = next;
  }
  PetscFunctionReturn(0);
}

/// What a model may need to know of the method before the first step.
static PetscErrorCode plan_of(TS ts, const TSContext& context, Plan* plan) {
  PetscReal theta, start;
  PetscInt most;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(theta_of(ts, &theta));
  PetscCall(TSGetTimeStep(ts, &plan->step));
  PetscCall(TSGetTime(ts, &start));
  PetscCall(TSGetMaxSteps(ts, &most));
  PetscCall(is_adaptive(ts, &adaptive));
  plan->implicit = context.implicit;
  plan->form = context.form;
  plan->type = context.method->type();
  plan->method = context.method->words();
  plan->descriptor = context.method->descriptor >= context.method->order;
  if (context.method->is(TSTHETA)) {
    PetscBool ends;
    PetscCall(TSThetaGetEndpoint(ts, &ends));
    plan->descriptor = ends;
    if (!ends) plan->method += " in its midpoint form (-ts_theta_endpoint false)";
  }
  plan->adaptive = adaptive;
  plan->any_step = context.implicit && theta >= 0.5;
  plan->steps = std::min(static_cast<double>(most), (context.pace.end - start) / plan->step);
  if (adaptive) PetscFunctionReturn(0);  // it shortens its steps where they are not stable
  if (plan->type == TSEULER) plan->polynomial = {1, 1};
  else if (plan->type == TSRK) PetscCall(polynomial_of_tableau(ts, &plan->polynomial));
  PetscFunctionReturn(0);
}

PetscErrorCode create_ts(Model& model, TSContext* context, TSHandle* ts) {
  const std::string type = value_of("-ts_type", TSBEULER);
  PetscFunctionBegin;
  context->model = &model;
  const std::string fault = fault_of_type(type);
  if (!fault.empty()) PetscCall(fail(model.comm(), Exit::input, fault));
  PetscCall(TSCreate(model.comm(), ts->out()));
  PetscCall(TSSetProblemType(*ts, model.linear() ? TS_LINEAR : TS_NONLINEAR));
  PetscCall(TSSetType(*ts, type.c_str()));
  PetscCall(choose_method(*ts, type.c_str(), context));
  if (context->method->is("alpha2")) PetscCall(alpha2_set_model(*ts, model));
  PetscCall(TSSetSolution(*ts, model.initial_state()));
  if (context->implicit) PetscCall(set_implicit(*ts, model, context));
  else PetscCall(TSSetRHSFunction(*ts, nullptr, form_rhs, context));
  PetscCall(TSSetTimeStep(*ts, context->pace.step));
  PetscCall(TSSetMaxTime(*ts, context->pace.end));
  PetscCall(TSSetExactFinalTime(*ts, TS_EXACTFINALTIME_STEPOVER));
  PetscCall(TSSetMaxSNESFailures(*ts, -1));
  PetscCall(TSSetErrorIfStepFails(*ts, PETSC_FALSE));
  PetscCall(set_from_options(*ts));
  PetscCall(context->rosenbrock.attach(*ts, model, context->form));
  PetscCall(check_stepping(*ts));
  PetscCall(check_method(*ts, *context));
  if (context->implicit) {
    PC pc;
    PetscCall(linear_solver_of(*ts, nullptr, &pc));
    PetscCall(make_pivots_relative(pc, false));
  }
  Plan plan;
  PetscCall(plan_of(*ts, *context, &plan));
  PetscCall(model.prepare(plan));
  if (context->implicit) PetscCall(context->predictor.attach(*ts, model, &context->newton));
  if (model.limits() && !context->predictor.within_limits())
    PetscCall(fail(model.comm(), Exit::input,
                   "forces that limit how far Newton's method goes at once: only beuler, cn and theta (with -ts_theta_endpoint) ask them, with the "
                   "line searches energy and guarded: write -ts_type beuler, and leave -snes_type and -snes_linesearch_type out"));
  PetscFunctionReturn(0);
}

PetscErrorCode create_inner_solver(TS ts, const TSContext& context) {
  PC pc;
  PetscFunctionBegin;
  if (!context.implicit) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_create_inner(pc));
  PetscFunctionReturn(0);
}

PetscErrorCode describe_solver(TS ts, const TSContext& context, double cut, std::string* line) {
  TSType type;
  TSAdapt adapt;
  TSAdaptType adapt_type;
  PetscFunctionBegin;
  PetscCall(TSGetType(ts, &type));
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptGetType(adapt, &adapt_type));
  const std::string control = adapt_type ? adapt_type : TSADAPTNONE;
  PetscReal h;
  PetscCall(TSGetTimeStep(ts, &h));
  PetscInt order;
  PetscCall(observed_order(ts, *context.method, &order));
  const std::string name = *context.method->subtype ? std::string(type) + " " + context.method->subtype : type;
  const std::string kind = format("%s, order %lld", context.implicit ? "implicit" : "explicit", static_cast<long long>(order)) +
                           (*context.method->remark ? std::string(": ") + context.method->remark : "");
  *line = format("%s (%s), %s h = %g s", name.c_str(), kind.c_str(),
                 control == TSADAPTNONE ? "fixed step" : ("steps by -ts_adapt_type " + control + ", first").c_str(), h);
  if (cut > 0) *line += format(", cut to %g s by -bs_output_interval", cut);
  if (!context.implicit) PetscFunctionReturn(0);
  SNES snes;
  KSP ksp;
  PC pc;
  SNESType snes_type;
  KSPType ksp_type;
  PCType pc_type;
  PetscReal atol, rtol, stol;
  PetscInt maxit, maxf;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetType(snes, &snes_type));
  PetscCall(SNESGetTolerances(snes, &atol, &rtol, &stol, &maxit, &maxf));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetType(ksp, &ksp_type));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetType(pc, &pc_type));
  std::string inner;
  bool free = false;
  PetscCall(is_on("-snes_mf", &free));
  if (free) pc_type = PCNONE;  // whatever -pc_type asks for: there is no matrix to make it of
  else PetscCall(condensed_describe(pc, &inner));
  const std::string solver =
      format("KSP %s, PC %s", ksp_type ? ksp_type : "gmres", pc_type ? pc_type : "default") + (inner.empty() ? "" : " (" + inner + ")");
  if (std::string(snes_type) == SNESKSPONLY) {
    *line += "; one linear solve a step (SNES ksponly); " + solver;
    PetscFunctionReturn(0);
  }
  std::string search;
  PetscCall(describe_search(snes, &search));
  *line += format("; SNES %s, line search %s, rtol %g of either residual; %s", snes_type, search.c_str(), rtol, solver.c_str());
  PetscFunctionReturn(0);
}

}  // namespace bs
