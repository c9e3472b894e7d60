// What stepping remembers from step to step, into a checkpoint and out of it.
#include <cmath>
#include <utility>
#include "base/error.hpp"
#include "linalg/condensed/condensed.hpp"
#include "time/implicit/solver_setup.hpp"
#include "time/methods.hpp"
#include "time/stepper.hpp"

namespace bs {

void Stepper::save(Facts* facts, std::vector<NamedState>* states) const {
  facts->real["time"] = good_time_;
  clock_.save(facts);
  length_.save(facts);
  counter_.save(facts);
  rejections_.save(facts);
  if (context_.implicit) {
    context_.newton.save(facts);
    (void)context_.predictor.save(facts);
  }
  reuse_.save(facts);
  history_.save(facts, states);
  model_.save_sums(&facts->real);
}

/// Ends the run with exit code 2 if a fact is missing without which no run can continue.
PetscErrorCode Stepper::require_facts(const Checkpoint& file) const {
  PetscFunctionBegin;
  const Facts& run = file.run();
  const auto require = [&](bool there, const char* name) {
    return there ? 0 : fail(model_.comm(), Exit::input, file.name() + ": damaged: it lacks its " + name + ": start a new run");
  };
  for (const char* name : {"time", "start", "nominal_step", "next_step", "first_step"})
    PetscCall(require(run.real.count(name) && std::isfinite(run.real.at(name)), name));
  for (const char* name : {"step", "rejected", "newton", "krylov", "shortened", "good_in_a_row"}) PetscCall(require(run.whole.count(name), name));
  PetscFunctionReturn(0);
}

/// What the method remembers of its last steps; a solver that is shown their answers counts iterations which are no step's.
PetscErrorCode Stepper::restore_method(TS ts, const Checkpoint& file, std::vector<std::string>* not_restored) {
  TSType type;
  std::string forgotten;
  PetscFunctionBegin;
  const Facts& run = file.run();
  PetscCall(TSGetType(ts, &type));
  const auto was = run.text.find("ts_type");
  const bool same = was != run.text.end() && was->second == type;
  const auto examine = std::exchange(context_.examine, nullptr);  // the steps that are repeated count already
  if (same) PetscCall(history_.restore(ts, model_, file, &forgotten));
  else not_restored->push_back(format("the method is %s; it was %s: it starts afresh", type, was == run.text.end() ? "?" : was->second.c_str()));
  context_.examine = examine;
  if (!forgotten.empty()) not_restored->push_back(format("%s starts afresh: ", type) + forgotten);
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::stand_at(TS ts, const Facts& run, std::string* changed) {
  PetscFunctionBegin;
  good_time_ = run.real.at("time");
  clock_.restore(run, good_time_);
  if (length_.adaptive()) sides_.right_at = good_time_;
  model_.set_sides(sides_);
  *changed = length_.restore(run);
  PetscCall(TSSetTime(ts, good_time_));
  PetscCall(TSSetTimeStep(ts, length_.next()));
  PetscCall(TSSetStepNumber(ts, static_cast<PetscInt>(run.whole.at("step"))));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::restore_counts(TS ts, const Facts& run) {
  PetscInt newton, krylov;
  PetscFunctionBegin;
  PetscCall(TSGetSNESIterations(ts, &newton));
  PetscCall(krylov_iterations(ts, context_.implicit, &krylov));
  rejections_.restore(run);
  if (context_.implicit) {
    context_.newton.restore(run);
    PetscCall(context_.predictor.restore(run));
  }
  counter_.restore(run, newton, krylov, rejections_.counts());
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::restore(TS ts, const Checkpoint& file, std::vector<std::string>* not_restored) {
  Vec y;
  std::string changed;
  PetscFunctionBegin;
  const Facts& run = file.run();
  PetscCall(require_facts(file));
  // a direct solver chooses its pivots' order at the first matrix it meets: it must be the one it met when the run began, or
  // the numbers differ in their last digits
  if (context_.implicit && run.real.at("first_step") > 0) PetscCall(factor_first_matrix(ts, context_, run.real.at("first_step")));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(file.read(model_, "/state", y));
  PetscCall(file.read_memory(model_));
  model_.restore_sums(run.real);
  PetscCall(stand_at(ts, run, &changed));
  if (!changed.empty()) not_restored->push_back(changed);
  PetscCall(check_start(ts, good_time_, length_.nominal()));
  PetscCall(restore_method(ts, file, not_restored));
  PetscCall(reuse_.restore(ts, run));
  PetscCall(restore_counts(ts, run));
  PetscCall(renew_solver(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::renew_solver(TS ts) const {
  PC pc;
  PetscFunctionBegin;
  if (!context_.implicit) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_renew(pc));
  PetscFunctionReturn(0);
}

}  // namespace bs
