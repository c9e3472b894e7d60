#include "tasks/statics/static_solver.hpp"
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/option_names.hpp"
#include "systems/frame_rows.hpp"
#include "time/methods.hpp"

namespace bs {

PetscErrorCode StaticSolver::create(std::unique_ptr<Model> model, const StaticsSettings& loads, const RunOptions& options) {
  PetscFunctionBegin;
  loads_ = loads;
  options_ = options;
  options_.advise = false;
  options_.energy_growth = 0;
  if (!model->tangent())
    PetscCall(fail(model->comm(), Exit::input,
                   model->mechanics() ? "-bs_task statics: a force that couples all particles has no tangent of its own: leave the force out"
                                      : "-bs_task statics: a linear system has no equilibria under loads: leave -bs_task out"));
  equilibrium_ = std::make_unique<Equilibrium>(model->take_mechanics(), loads.rules);
  PetscCall(equilibrium_->begin());
  PetscFunctionReturn(0);
}

PetscErrorCode StaticSolver::analyse(bool moduli) {
  PetscFunctionBegin;
  end_ = std::make_unique<FinalAnalyses>();
  PetscCall(end_->compliance.begin(*equilibrium_, loads_.compliance_groups));
  if (moduli && !is_given("-help")) PetscCall(end_->moduli.begin(*equilibrium_, loads_.zero_modes_unknowns));
  PetscCall(lock_outputs(equilibrium_->comm(), options_, &locks_));
  PetscFunctionReturn(0);
}

PetscErrorCode StaticSolver::observe(double factor, Vec y, std::vector<Observable>* out) {
  PetscFunctionBegin;
  found_.factor = factor;
  PetscCall(assess_(factor, y, out));
  found_.observables = *out;
  PetscCall(copy_into(&last_, y));
  PetscFunctionReturn(0);
}

PetscErrorCode StaticSolver::run(int* exit_code) {
  PetscFunctionBegin;
  statics_ = std::make_unique<StaticRun>(*equilibrium_, loads_, end_.get());
  PetscCall(statics_->begin_box());
  RunHooks hooks = statics_->hooks();
  hooks.only_run = end_ != nullptr;
  hooks.on_step = held_by<LoadStepObserver>(equilibrium_->comm()).on_step;
  assess_ = hooks.observe;
  hooks.observe = [this](double factor, Vec y, std::vector<Observable>* out) { return observe(factor, y, out); };
  hooks.concluded = [this](const std::string& outcome, const std::string& why) {
    found_.outcome = outcome;
    found_.why = why;
  };
  run_ = std::make_unique<Run>(*equilibrium_, options_, hooks);
  PetscCall(run_->set_up());
  const PetscErrorCode code = run_->advance(exit_code);
  found_.counts = run_->counts();
  PetscCall(run_->save_warnings(&found_.warnings));
  PetscFunctionReturn(code);
}

PetscErrorCode StaticSolver::follow() {
  Vec y;
  std::string failure;
  std::vector<Observable> observables;
  PetscInt newton[2], krylov[2];
  PetscFunctionBegin;
  if (loads_.arc) PetscCall(fail(equilibrium_->comm(), Exit::input, "-bs_load_control arc: a path is not followed further: leave the option out"));
  PetscCall(run_->state_vector(&y));
  PetscCall(TSGetSNESIterations(run_->stepper(), &newton[0]));
  PetscCall(krylov_iterations(run_->stepper(), true, &krylov[0]));
  PetscCall(statics_->follow(found_.factor, y, &failure));
  PetscCall(TSGetSNESIterations(run_->stepper(), &newton[1]));
  PetscCall(krylov_iterations(run_->stepper(), true, &krylov[1]));
  found_.counts = {};
  found_.counts.newton = newton[1] - newton[0];
  found_.counts.krylov = krylov[1] - krylov[0];
  found_.outcome = failure.empty() ? "ok" : "failed";
  PetscCall(equilibrium_->observe(found_.factor, y, &observables));
  PetscCall(observe(found_.factor, y, &observables));
  if (!failure.empty()) PetscCall(fail(equilibrium_->comm(), Exit::solve, failure));
  PetscFunctionReturn(0);
}

PetscErrorCode StaticSolver::sensitivities(const std::vector<double>& slope, const std::vector<std::string>& names,
                                           std::vector<std::vector<double>>* out) {
  VecHandle lambda;
  std::vector<double> rows;
  PetscFunctionBegin;
  out->resize(names.size());
  PetscCall(VecDuplicate(last_, lambda.out()));
  PetscCall(statics_->adjoint(found_.factor, last_, slope, lambda));
  for (std::size_t k = 0; k < names.size(); ++k) {
    PetscCall(equilibrium_->mechanics()->force_changes(names[k], equilibrium_->factor(found_.factor), last_, lambda, &rows));
    PetscCall(gather_all(equilibrium_->comm(), std::move(rows), &(*out)[k]));
  }
  PetscFunctionReturn(0);
}

/// What a frame has of the equilibrium at (t, y) beside its observables; t: the place of the load step.
PetscErrorCode StaticSolver::describe(double t, Vec y, FrameData* out) {
  std::vector<double> reactions, rows;
  PetscFunctionBegin;
  out->time = t;
  PetscCall(read_tables(*equilibrium_, t, y, &out->tables));
  PetscCall(read_breaks(*equilibrium_, &out->breaks));
  PetscCall(read_state(*equilibrium_, equilibrium_->factor(t), y, true, &out->state));
  PetscCall(equilibrium_->reactions(t, y, &reactions));
  PetscCall(rows_of_particles(*equilibrium_, y, reactions.data(), &rows));
  PetscCall(gather_all(equilibrium_->comm(), std::move(rows), &out->reaction));
  PetscFunctionReturn(0);
}

PetscErrorCode StaticSolver::frame(FrameData* out) {
  Vec y;
  double t = 0;
  PetscFunctionBegin;
  PetscCall(run_->state_vector(&y));
  PetscCall(TSGetTime(run_->stepper(), &t));
  PetscCall(equilibrium_->observe(t, y, &out->observables));
  PetscCall(describe(t, y, out));
  PetscFunctionReturn(0);
}

PetscErrorCode StaticSolver::copy_to(Result* out) {
  PetscFunctionBegin;
  if (!last_ || found_.outcome.empty()) PetscFunctionReturn(0);
  out->load_factor = equilibrium_->factor(found_.factor);
  out->steps = found_.counts.steps;
  out->rejected = found_.counts.rejected;
  out->newton = found_.counts.newton;
  out->krylov = found_.counts.krylov;
  out->frame.observables = found_.observables;
  PetscCall(describe(found_.factor, last_, &out->frame));
  if (found_.outcome == "ok" && end_ && end_->moduli.wanted()) end_->moduli.copy_results(out);
  PetscFunctionReturn(0);
}

std::unique_ptr<Equilibrium> StaticSolver::let_go() {
  run_.reset();
  statics_.reset();
  return std::move(equilibrium_);
}

}  // namespace bs
