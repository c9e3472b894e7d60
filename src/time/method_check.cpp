#include <algorithm>
#include <cmath>
#include <string>
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "base/vec_array.hpp"
#include "systems/layout.hpp"
#include "time/methods.hpp"
#include "time/own_type.hpp"
#include "time/ts_setup.hpp"

namespace bs {

namespace {

/// Options of TS that need what this program does not set up: PETSc crashes or stops at the first step.
PetscErrorCode fault_of_options(std::string* fault) {
  bool estimate = false, parts = false;
  PetscFunctionBegin;
  PetscCall(is_on("-ts_convergence_estimate", &estimate));
  PetscCall(is_on("-ts_rk_multirate", &parts));
  if (estimate) *fault = "option -ts_convergence_estimate: is not for this program: postprocess/sweep.py runs a study and shows the orders";
  else if (is_given("-ts_time_span"))
    *fault = "option -ts_time_span: is not for this program: give -ts_init_time, -ts_max_time and -bs_output_interval";
  else if (parts) *fault = "option -ts_rk_multirate: needs a system split into fast and slow parts: leave it out";
  PetscFunctionReturn(0);
}

/// Steps that follow an error estimate need one. A type that has none keeps its step, unless adaptivity was asked for.
PetscErrorCode fault_of_adaptivity(TS ts, const Method& method, std::string* fault) {
  TSAdapt adapt;
  TSAdaptType type = nullptr;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptGetType(adapt, &type));
  PetscCall(is_adaptive(ts, &adaptive));
  if (!adaptive) PetscFunctionReturn(0);
  const std::string name = type;
  if (name != TSADAPTBASIC && name != TSADAPTDSP)
    *fault = "option -ts_adapt_type: " + name + " needs data that this program does not provide: write basic, dsp or none";
  else if (!method.estimate && is_given("-ts_adapt_type"))
    *fault = "option -ts_adapt_type: " + name + ": " + method.words() +
             " does not estimate its error, so its step cannot be adapted to it: leave the option out";
  else if (!method.estimate) PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
  PetscFunctionReturn(0);
}

PetscErrorCode fault_of_stages(TS ts, const Method& method, std::string* fault) {
  PetscInt stages;
  PetscFunctionBegin;
  if (!method.is(TSSSP)) PetscFunctionReturn(0);
  PetscCall(TSSSPGetNumStages(ts, &stages));
  const std::string subtype = method.subtype, what = format("option -ts_ssp_nstages: %lld: ", static_cast<long long>(stages));
  const auto root = static_cast<PetscInt>(std::lround(std::sqrt(static_cast<double>(std::max<PetscInt>(stages, 0)))));
  if (subtype == TSSSPRKS2 && stages < 2) *fault = what + "rks2 needs 2 or more stages";
  else if (subtype == TSSSPRKS3 && (stages < 4 || root * root != stages)) *fault = what + "rks3 needs a square number of stages: 4, 9, 16, ...";
  else if (subtype == TSSSPRK104 && is_given("-ts_ssp_nstages") && stages != 10) *fault = what + "rk104 has 10 stages: leave the option out";
  PetscFunctionReturn(0);
}

PetscErrorCode fault_of_alpha2(TS ts, const Method& method, std::string* fault) {
  PetscFunctionBegin;
  if (!method.is("alpha2")) PetscFunctionReturn(0);
  const AlphaParameters p = alpha2_parameters(ts);
  const std::string what = format("alpha_m = %g, alpha_f = %g, gamma = %g, beta = %g: ", p.m, p.f, p.gamma, p.beta);
  const bool finite = std::isfinite(p.m) && std::isfinite(p.f) && std::isfinite(p.gamma) && std::isfinite(p.beta);
  if (!finite || !(p.m >= p.f && p.f >= 0.5 && p.beta >= 0.25 + (p.m - p.f) / 2 - 1e-12))
    *fault =
        what + "-ts_type alpha2 is stable where alpha_m >= alpha_f >= 1/2 and beta >= 1/4 + (alpha_m - alpha_f)/2: give -ts_alpha_radius, 0 to 1";
  else if (std::abs(0.5 + p.m - p.f - p.gamma) > 1e-12)
    *fault = what + "-ts_type alpha2 has order 2 only with gamma = 1/2 + alpha_m - alpha_f: give -ts_alpha_radius, 0 to 1, or use beuler";
  PetscFunctionReturn(0);
}

/// One linear solve a step, or a stage, is right only with the Jacobian and the factors of that step.
PetscErrorCode fault_of_lag(SNES snes, const std::string& method, std::string* fault) {
  PetscInt jacobian, preconditioner;
  PetscFunctionBegin;
  PetscCall(SNESGetLagJacobian(snes, &jacobian));
  PetscCall(SNESGetLagPreconditioner(snes, &preconditioner));
  const bool first = jacobian != 1;
  if (first || preconditioner != 1)
    *fault = format("option -snes_lag_%s: %lld: ", first ? "jacobian" : "preconditioner", static_cast<long long>(first ? jacobian : preconditioner)) +
             method + " solves one linear system and needs its own Jacobian: leave the option out";
  PetscFunctionReturn(0);
}

/// The stages of rosw are linear systems with the Jacobian at the start of the step; Newton's method on them, or a Jacobian
/// taken elsewhere, makes another method of lower order.
PetscErrorCode fault_of_rosw(const TSContext& context, bool once, std::string* fault) {
  const RosenbrockStages& stages = context.rosenbrock;
  const std::string words = context.method->words();
  std::string name, differences;
  PetscFunctionBegin;
  if (!stages.active()) PetscFunctionReturn(0);
  PetscCall(first_on({"-snes_mf", "-snes_mf_operator"}, &name));
  PetscCall(first_on({"-snes_fd", "-snes_fd_color"}, &differences));
  const bool linear = context.model->linear();
  if (!linear && !once)
    *fault = "option -snes_type: " + words + " solves one linear system a stage, Newton's method would lower its order: leave the option out";
  else if (!name.empty() && (!linear || stages.has_explicit_stage()))
    *fault = "option " + name + ": " + words + " needs the Jacobian at the start of the step, not where its stages are: leave the option out";
  else if (!differences.empty() && stages.has_own_matrices())
    *fault = "option " + differences + ": the stages of " + words + " need the program's own Jacobian: leave the option out, or take ra34pw2";
  else if (stages.has_stage_before() && context.model->time_dependent())
    *fault = words +
             " evaluates the forces or sources at a time before its step (t - 2 h in PETSc's tableau), where they may be others: "
             "use -ts_rosw_type ra34pw2 or sandu3, or -ts_type arkimex -ts_arkimex_type 4";
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode check_method(TS ts, const TSContext& context) {
  const Method& method = *context.method;
  std::string fault;
  PetscFunctionBegin;
  if (method.traits->second_order && context.model->dim() == 0)
    fault = method.words() + " needs positions and velocities: use " + (method.implicit() ? "cn or bdf" : "euler or rk") + " for a linear system";
  if (fault.empty()) PetscCall(fault_of_options(&fault));
  if (fault.empty()) PetscCall(fault_of_adaptivity(ts, method, &fault));
  if (fault.empty()) PetscCall(fault_of_stages(ts, method, &fault));
  if (fault.empty()) PetscCall(fault_of_alpha2(ts, method, &fault));
  if (fault.empty() && method.implicit()) {
    SNES snes;
    PetscBool once = PETSC_FALSE;
    PetscCall(TSGetSNES(ts, &snes));
    PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESKSPONLY, &once));
    if (once || context.rosenbrock.active()) PetscCall(fault_of_lag(snes, method.words(), &fault));
    if (fault.empty()) PetscCall(fault_of_rosw(context, once, &fault));
  }
  if (!fault.empty()) PetscCall(fail(context.model->comm(), Exit::input, fault));
  PetscFunctionReturn(0);
}

namespace {

PetscErrorCode fault_of_times(TS ts, std::string* fault) {
  PetscReal h, start, end;
  PetscInt steps;
  PetscFunctionBegin;
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(TSGetTime(ts, &start));
  PetscCall(TSGetMaxTime(ts, &end));
  PetscCall(TSGetMaxSteps(ts, &steps));
  if (!(h > 0) || !std::isfinite(h)) *fault = format("option -ts_dt: %g: give a time step > 0 [s]", h);
  else if (!std::isfinite(start)) *fault = format("option -ts_init_time: %g: give a finite time [s]", start);
  else if (!std::isfinite(end) || end < start)
    *fault = format("option -ts_max_time: %g: give a finite time at or after the start, t = %g s", end, start);
  else if (steps < 0) *fault = format("option -ts_max_steps: %lld: give a number of steps >= 0", static_cast<long long>(steps));
  PetscFunctionReturn(0);
}

PetscErrorCode fault_of_theta(TS ts, std::string* fault) {
  const Method* method;
  PetscReal value;
  PetscFunctionBegin;
  PetscCall(method_of(ts, &method));
  if (!method->remembers(Memory::theta)) PetscFunctionReturn(0);
  PetscCall(theta_of(ts, &value));
  if (!(value > 0 && value <= 1)) *fault = format("option -ts_theta_theta: %g: give a number above 0 and at most 1", value);
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode check_stepping(TS ts) {
  std::string fault;
  PetscFunctionBegin;
  PetscCall(fault_of_times(ts, &fault));
  if (fault.empty()) PetscCall(fault_of_theta(ts, &fault));
  if (!fault.empty()) PetscCall(fail(PetscObjectComm(reinterpret_cast<PetscObject>(ts)), Exit::input, fault));
  PetscFunctionReturn(0);
}

namespace {

/// x for every position, v for every velocity.
PetscErrorCode fill(Vec vec, double x, double v) {
  PetscFunctionBegin;
  const WriteArray a(vec);
  layout_of(vec).for_each([&](PetscInt position, PetscInt velocity) {
    a[position] = x;
    a[velocity] = v;
  });
  PetscFunctionReturn(0);
}

/// Tolerances that are no tolerances; where steps follow an error estimate, those that leave a part of the state without.
PetscErrorCode check(const Tolerances& t, bool adaptive, double atol, double rtol, MPI_Comm comm) {
  std::string fault;
  PetscFunctionBegin;
  if (!(atol >= 0) || !std::isfinite(atol)) fault = format("option -ts_atol: %g: give a finite number >= 0", atol);
  else if (!(rtol >= 0 && rtol < 1)) fault = format("option -ts_rtol: %g: give a number >= 0 and below 1", rtol);
  else if (t.rtol_x >= 1 || t.rtol_v >= 1)
    fault = format("option -bs_rtol_%s: %g: give a number below 1", t.rtol_x >= 1 ? "x" : "v", t.rtol_x >= 1 ? t.rtol_x : t.rtol_v);
  else if (adaptive && atol + rtol == 0 && !(t.atol_x + t.rtol_x > 0 && t.atol_v + t.rtol_v > 0))
    fault =
        "options -ts_atol and -ts_rtol: both 0 leave the steps without error control: give one of them, e.g. -ts_rtol 1e-6, "
        "or a fixed step by -ts_adapt_type none";
  if (!fault.empty()) PetscCall(fail(comm, Exit::input, fault));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_tolerances(MPI_Comm comm, Tolerances* out) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Error control", [&](Section& o) {
    o.real("-bs_atol_x", "error-controlled steps: absolute tolerance of positions; 0: -ts_atol [m]", out->atol_x, Range::nonnegative);
    o.real("-bs_atol_v", "error-controlled steps: absolute tolerance of velocities; 0: -ts_atol [m/s]", out->atol_v, Range::nonnegative);
    o.real("-bs_rtol_x", "error-controlled steps: relative tolerance of positions; 0: -ts_rtol", out->rtol_x, Range::nonnegative);
    o.real("-bs_rtol_v", "error-controlled steps: relative tolerance of velocities; 0: -ts_rtol", out->rtol_v, Range::nonnegative);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode set_tolerances(const Tolerances& t, Model& model, TS ts) {
  PetscReal atol, rtol;
  VecHandle vatol, vrtol;
  bool adaptive = false;
  PetscFunctionBegin;
  PetscCall(is_adaptive(ts, &adaptive));
  PetscCall(TSGetTolerances(ts, &atol, nullptr, &rtol, nullptr));
  PetscCall(check(t, adaptive, atol, rtol, model.comm()));
  if (!t.given() && !adaptive) PetscFunctionReturn(0);
  if (t.given() && model.dim() == 0)
    PetscCall(fail(model.comm(), Exit::input,
                   "options -bs_atol_x, -bs_atol_v, -bs_rtol_x, -bs_rtol_v apply to particles only: give -ts_atol and -ts_rtol"));
  if (t.given()) PetscCall(VecDuplicate(model.initial_state(), vatol.out()));
  else PetscCall(model.mark_differential(vatol.out()));
  if (!vatol) PetscFunctionReturn(0);
  PetscCall(VecDuplicate(vatol, vrtol.out()));
  if (t.given()) {
    PetscCall(fill(vatol, t.atol_x > 0 ? t.atol_x : atol, t.atol_v > 0 ? t.atol_v : atol));
    PetscCall(fill(vrtol, t.rtol_x > 0 ? t.rtol_x : rtol, t.rtol_v > 0 ? t.rtol_v : rtol));
  } else {
    PetscCall(VecCopy(vatol, vrtol));
    PetscCall(VecScale(vatol, atol));
    PetscCall(VecScale(vrtol, rtol));
  }
  PetscCall(TSSetTolerances(ts, atol, vatol, rtol, vrtol));
  PetscFunctionReturn(0);
}

}  // namespace bs
