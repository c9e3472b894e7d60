// How a run ended: in the user's words, in the summary, in the report.
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "output/report.hpp"
#include "systems/system.hpp"
#include "tasks/run.hpp"
#include "tasks/unused_options.hpp"
#include "time/implicit/solver_setup.hpp"

namespace bs {

double total_energy(const std::vector<Observable>& observables) {
  for (const Observable& o : observables)
    if (o.name == "total_energy") return o.value[0];
  return NAN;
}

/// Why the solver gave up, in the user's words, and what to try.
PetscErrorCode Run::explain(TSConvergedReason reason, std::string* text) {
  PetscFunctionBegin;
  std::string fault;
  PetscCall(model_.last_fault(&fault));
  const double t = stepper_->good_time();
  PetscReal h;
  PetscCall(TSGetTimeStep(ts_, &h));
  const RejectionWatch& rejections = stepper_->rejections();
  if (!stepper_->ending().empty()) {
    *text = stepper_->ending();
    PetscFunctionReturn(0);
  }
  if (rejections.gave_up()) {
    const bool loads = hooks_.loads && !rejections.lacks_memory();
    std::string advice;
    PetscCall(model_.advice(t, &advice));
    if (advice.empty()) advice = loads ? "-snes_monitor -snes_linesearch_monitor show more" : rejections.advice();
    const std::string after = hooks_.loads ? format("the load step after %s %.10g", hooks_.clock, t) : format("the step after t = %.10g s", t);
    *text = format("%s was rejected %s, down to %s = %g%s, the last time because %s%s%s", after.c_str(),
                   how_many(rejections.in_a_row(), "time").c_str(), hooks_.loads ? "a step" : "h", rejections.last_attempt(),
                   hooks_.loads ? "" : " s", rejections.last().c_str(), advice.empty() ? "" : ": ", advice.c_str());
    PetscFunctionReturn(0);
  }
  if (!stepper_->trouble().empty() || !context_.implicit) {
    *text = format("the step after t = %g s gave no finite state", t);
    if (!fault.empty()) *text += ": " + fault;
    else *text += format(": try -ts_dt below %g", h) + (context_.implicit ? "" : ", or an implicit -ts_type such as beuler");
    PetscFunctionReturn(0);
  }
  SNES snes;
  SNESConvergedReason snes_reason;
  PetscCall(TSGetSNES(ts_, &snes));
  PetscCall(SNESGetConvergedReason(snes, &snes_reason));
  *text = format("no step after t = %g s converged down to h = %g s (Newton: %s; TS: %s)", t, h, SNESConvergedReasons[snes_reason],
                 TSConvergedReasons[reason]);
  *text += fault.empty() ? ": try a smaller -ts_dt, -snes_linesearch_type l2 or a tighter -ksp_rtol; -snes_monitor -ksp_converged_reason show more"
                         : "; " + fault;
  PetscFunctionReturn(0);
}

/// Steps that were cut deeply say that the solver does not suit the problem, or that something happens there.
PetscErrorCode Run::warn_of_cuts() {
  constexpr double DEEP = 0.01;
  const double least = stepper_->shortest_cut(), nominal = stepper_->nominal_step();
  PetscFunctionBegin;
  if (least == 0 || least > DEEP * nominal) PetscFunctionReturn(0);
  const double asked = std::ceil((stepper_->good_time() - start_) / nominal * (1 - 1e-9));
  const std::string advice =
      hooks_.loads ? "more -bs_load_steps, or -bs_load_control arc, may suit the loads better" : stepper_->rejections().advice();
  const std::string steps = hooks_.loads ? "load steps" : "steps";
  PetscCall(warnings_.add("steps_cut", format("%s were cut to %.2g of their length: %lld were taken where %.0f were asked for; %s rejected (%s)%s%s",
                                              steps.c_str(), least / nominal, static_cast<long long>(stepper_->counts().steps), asked,
                                              how_many(stepper_->counts().rejected, "attempt{ was|s were}").c_str(),
                                              in_words(stepper_->rejections().counts()).c_str(), advice.empty() ? "" : ": ", advice.c_str())));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::warn_of_early_end() {
  PetscFunctionBegin;
  PetscCall(warnings_.add("ended_early", format("the run ended after the %s of -ts_max_steps, at %s %.10g of %.10g: give more of them",
                                                how_many(stepper_->counts().steps + earlier_steps_, "step").c_str(),
                                                hooks_.loads ? hooks_.clock : "t =", stepper_->good_time(), end_)));
  PetscFunctionReturn(0);
}

/// What the end tells of the whole run. `reason`: of the TS.
PetscErrorCode Run::final_warnings(TSConvergedReason reason) {
  PetscFunctionBegin;
  PetscCall(warn_of_cuts());
  if (reason == TS_CONVERGED_ITS) PetscCall(warn_of_early_end());
  if (context_.newton.loose() > 0)
    PetscCall(
        warnings_.add("newton_loose", format("%s ended by the tolerances that are given (-snes_atol, -snes_rtol) with more than a thousandth of the "
                                             "residual left: the motion is not that of the equations; lower them",
                                             how_many(context_.newton.loose(), "Newton solve{ was|s were}").c_str())));
  PetscCall(tolerance_watch_.warn(ts_, &warnings_));
  if (hooks_.final_warnings) PetscCall(hooks_.final_warnings(&warnings_));
  PetscFunctionReturn(0);
}

PetscErrorCode Run::report(const std::string& outcome, const std::string& why) {
  const RunCounts& c = stepper_->counts();
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(model_.comm());
  if (!options_.output.report.empty()) {
    Report report;
    report.set("outcome", outcome);
    report.set("reason", why);
    report.set("model", std::string(model_.name()));
    report.set("solver", solver_);
    report.set("ranks", static_cast<std::int64_t>(size));
    report.set("t", stepper_->good_time());
    report.set("steps", static_cast<std::int64_t>(c.steps));
    for (const Tally& tally : tallies()) tally.unknown.empty() ? report.set(tally.key, tally.count) : report.set(tally.key, NAN);
    report.set("shortened_steps", static_cast<std::int64_t>(c.shortened));
    report.set("rejected", static_cast<std::int64_t>(c.rejected));
    for (std::size_t k = 0; k < std::size(REJECTION_REASONS); ++k)
      report.set(std::string("rejected_") + REJECTION_REASONS[k].key, stepper_->rejections().counts()[k]);
    report.set("newton", static_cast<std::int64_t>(c.newton));
    report.set("krylov", static_cast<std::int64_t>(c.krylov));
    report.set("wall", progress_.wall());
    report.set("warnings", warnings_.keys());
    advice_.put(&report);
    report.set("frames", trajectory_ ? trajectory_->frames() : std::int64_t{0});
    for (const Observable& o : first_) report.set("first_" + o.name, o.value);
    for (const Observable& o : last_) report.set("last_" + o.name, o.value);
    report.add(results_.report);
    PetscCall(report.write(model_.comm(), options_.output.report, options_.output.trajectory.overwrite));
  }
  progress_.finish(state(), outcome, closing_lines());
  PetscFunctionReturn(0);
}

std::vector<Tally> Run::tallies() const {
  std::vector<Tally> all = model_.tallies();
  if (context_.implicit && solver_tallies(ts_, &all)) all.clear();
  if (hooks_.count && hooks_.count(&all)) all.clear();
  const SearchMemory& search = context_.newton.search;
  all.push_back({"search_cuts", "", search.cuts});
  all.push_back({"guess_substeps", "", context_.predictor.substeps()});
  all.push_back({"newton_loose", "", context_.newton.loose()});
  all.push_back(
      {"newton_at_floor", "Newton solve{s} ended at the rounding errors of the forces, before reaching -snes_rtol", context_.newton.at_floor()});
  all.push_back(
      {"newton_uneven", "iterate{s} met the tolerance in the norm over all particles, but not yet for each of them", context_.newton.uneven()});
  all.push_back(
      {"search_uphill", "Newton direction{ led uphill in energy and was|s led uphill in energy and were} searched by residual norms", search.uphill});
  for (Tally& tally : all)
    if (const auto more = earlier_.find(tally.key); more != earlier_.end()) tally.count += more->second;
  return all;
}

std::vector<std::string> Run::closing_lines() const {
  std::vector<std::string> lines;
  const RunCounts& c = stepper_->counts();
  const double before = total_energy(first_), after = total_energy(last_);
  if (std::isfinite(before)) lines.push_back(format("total energy %.6g J -> %.6g J", before, after));
  for (const Tally& tally : tallies())
    if (!tally.unknown.empty()) lines.push_back(tally.unknown);
    else if (tally.count > 0 && !tally.text.empty()) lines.push_back(how_many(tally.count, tally.text));
  lines.insert(lines.end(), results_.lines.begin(), results_.lines.end());
  if (rests_) lines.push_back(format("ended at rest, at t = %.10g s", stepper_->good_time()));
  if (c.shortened) lines.push_back(how_many(c.shortened, "step") + " shortened to hit output times");
  if (c.rejected)
    lines.push_back(how_many(c.rejected, "attempt") + " rejected and repeated with a smaller step: " + in_words(stepper_->rejections().counts()));
  if (!stepper_->rejections().last().empty()) lines.push_back("the last rejection: " + stepper_->rejections().last());
  if (trajectory_) lines.push_back(how_many(trajectory_->frames(), "frame") + " in " + options_.output.trajectory.file);
  std::vector<std::string> unused;
  if (hooks_.only_run && !unused_options(&unused))
    for (const std::string& name : unused) lines.push_back("option " + name + " was never used");
  return lines;
}

/// What the task asks for at the last state. A continued run that took no step has the tables of the run before it.
PetscErrorCode Run::run_final_analyses() {
  Vec y;
  PetscFunctionBegin;
  if (!hooks_.find) PetscFunctionReturn(0);
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(hooks_.find(stepper_->good_time(), y, &results_));
  set_phase(model_.comm(), Exit::io);
  for (const Dataset& table : results_.tables)
    if (trajectory_ && !untouched()) PetscCall(trajectory_->write_table(table));
  set_phase(model_.comm(), Exit::solve);
  PetscFunctionReturn(0);
}

/// The list of what broke, whatever the outcome.
PetscErrorCode Run::write_breaks() {
  std::vector<Dataset> tables;
  PetscFunctionBegin;
  if (!trajectory_ || !model_.breaks() || untouched()) PetscFunctionReturn(0);
  PetscCall(model_.breaks()->tables(&tables));
  set_phase(model_.comm(), Exit::io);
  for (const Dataset& table : tables) PetscCall(trajectory_->write_table(table));
  set_phase(model_.comm(), Exit::solve);
  PetscFunctionReturn(0);
}

PetscErrorCode Run::conclude(TSConvergedReason reason, int* exit_code) {
  PetscFunctionBegin;
  std::string why;
  if (reason < 0) PetscCall(explain(reason, &why));
  else if (stepper_->signal()) why = format("stopped by signal %d", stepper_->signal());
  else PetscCall(run_final_analyses());
  const bool failed = reason < 0 || !results_.failure.empty();
  if (reason >= 0 && failed) why = results_.failure;
  PetscCall(write_breaks());
  if (trajectory_) {
    set_phase(model_.comm(), Exit::io);
    PetscCall(trajectory_->close());
  }
  // of a run before this one, whose trajectory is no more
  if (!failed && !stepper_->signal() && trajectory_ && options_.output.trajectory.overwrite && options_.saving.restart.empty())
    PetscCall(remove_stale_checkpoint(model_.comm(), options_.output.trajectory.file, options_.saving.file));
  PetscCall(final_warnings(reason));
  const char* const outcome = failed ? "failed" : stepper_->signal() ? "stopped" : "ok";
  if (hooks_.concluded) hooks_.concluded(outcome, why);
  PetscCall(report(outcome, why));
  if (failed && !last_checkpoint_.empty()) why += format("; the last good state is in %s (-bs_restart)", last_checkpoint_.c_str());
  if (failed) PetscCall(fail(model_.comm(), Exit::solve, why));
  if (stepper_->signal()) *exit_code = 128 + stepper_->signal();
  PetscFunctionReturn(0);
}

}  // namespace bs
