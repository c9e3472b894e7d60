// What stepping remembers from step to step, into a checkpoint and out of it.
#include <cmath>
#include "base/fault.hpp"
#include "solve/condensed/condensed.hpp"
#include "solve/stepper.hpp"
#include "solve/ts_queries.hpp"

namespace bs {

void Stepper::save(Facts* facts, std::vector<NamedState>* states) const {
  facts->real["time"] = good_time_;
  facts->real["start"] = start_;
  facts->real["nominal_step"] = nominal_;
  facts->real["next_step"] = next_;
  facts->real["first_step"] = first_;
  facts->whole["step"] = counts_.steps;
  facts->whole["rejected"] = counts_.rejected;
  facts->whole["newton"] = counts_.newton;
  facts->whole["krylov"] = counts_.krylov;
  facts->whole["shortened"] = counts_.shortened;
  facts->whole["good_in_a_row"] = good_in_a_row_;
  rejections_.save(facts);
  history_.save(facts, states);
}

/// A direct solver chooses its pivots' order at the first matrix it meets: it must be the one it met when the run began,
/// or the numbers differ in their last digits.
PetscErrorCode Stepper::prime_solvers(TS ts, double sigma_step) {
  SNES snes;
  KSP ksp;
  Vec y;
  PetscReal t;
  double sigma;
  Mat A, P;
  PetscBool shell = PETSC_FALSE;
  PetscFunctionBegin;
  if (!context_.implicit || sigma_step <= 0) PetscFunctionReturn(0);
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(shift_of_step(ts, sigma_step, &sigma));
  PetscCall(SNESSetUp(snes));
  PetscCall(SNESGetJacobian(snes, &A, &P, nullptr, nullptr));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(P), MATMFFD, &shell));
  if (shell) PetscFunctionReturn(0);
  VecHandle zero;
  PetscCall(VecDuplicate(y, zero.out()));
  PetscCall(VecZeroEntries(zero));
  PetscCall(context_.model->jacobian(t, y, zero, sigma, context_.form, context_.matrix));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPSetOperators(ksp, context_.operator_, context_.matrix));
  PetscCall(KSPSetUp(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode Stepper::restore(TS ts, const CheckpointFile& file, std::vector<std::string>* told) {
  Vec y;
  TSType type;
  PetscInt newton, krylov;
  std::string forgotten;
  PetscFunctionBegin;
  const Facts& run = file.run();
  for (const char* name : {"time", "start", "nominal_step", "next_step", "first_step"})
    if (!run.real.count(name) || !std::isfinite(run.real.at(name))) PetscCall(tell(model_.comm(), Exit::input, file.name() + ": damaged: it does not say its " + name + ": start anew"));
  for (const char* name : {"step", "rejected", "newton", "krylov", "shortened", "good_in_a_row"})
    if (!run.whole.count(name)) PetscCall(tell(model_.comm(), Exit::input, file.name() + ": damaged: it does not say its " + name + ": start anew"));
  PetscCall(prime_solvers(ts, run.real.at("first_step")));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(file.read(model_, "/state", y));
  PetscCall(file.read_memory(model_));
  good_time_ = run.real.at("time");
  start_ = run.real.at("start");
  first_ = run.real.at("first_step");
  if (std::abs(run.real.at("nominal_step") - nominal_) <= 1e-14 * nominal_) {
    next_ = run.real.at("next_step");
  } else {
    told->push_back(format("the step is -ts_dt %g; it was %g", nominal_, run.real.at("nominal_step")));
    next_ = nominal_;
  }
  good_in_a_row_ = run.whole.at("good_in_a_row");
  counts_.steps = static_cast<PetscInt>(run.whole.at("step"));
  counts_.rejected = static_cast<PetscInt>(run.whole.at("rejected"));
  counts_.newton = static_cast<PetscInt>(run.whole.at("newton"));
  counts_.krylov = static_cast<PetscInt>(run.whole.at("krylov"));
  counts_.shortened = static_cast<PetscInt>(run.whole.at("shortened"));
  // the next output time is the first one after now
  if (options_.output_interval > 0)
    frame_ = static_cast<std::int64_t>(std::floor((good_time_ - start_) / options_.output_interval * (1 + 1e-14) + 1e-9)) + 1;
  PetscCall(tell_lost_steps(good_time_, nominal_));
  PetscCall(TSSetTime(ts, good_time_));
  PetscCall(TSSetTimeStep(ts, next_));
  PetscCall(TSSetStepNumber(ts, counts_.steps));
  PetscCall(TSGetType(ts, &type));
  const auto was = run.text.find("ts_type");
  if (was == run.text.end() || was->second != type) told->push_back(format("the method is %s; it was %s: it starts afresh", type, was == run.text.end() ? "?" : was->second.c_str()));
  else PetscCall(history_.restore(ts, model_, file, &forgotten));
  if (!forgotten.empty()) told->push_back(format("%s starts afresh: ", type) + forgotten);
  PetscCall(TSGetSNESIterations(ts, &newton));
  PetscCall(krylov_iterations(ts, &krylov));
  base_.newton = counts_.newton - newton;
  base_.krylov = counts_.krylov - krylov;
  rejections_.restore(run);
  rejected_before_ = rejections_.counts();
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
