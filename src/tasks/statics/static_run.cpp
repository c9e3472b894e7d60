#include "tasks/statics/static_run.hpp"
#include <limits>
#include "base/error.hpp"
#include "linalg/condensed/condensed.hpp"
#include "systems/system.hpp"
#include "time/methods.hpp"

namespace bs {

RunHooks StaticRun::hooks() {
  const double step = 1.0 / static_cast<double>(options_.steps);
  RunHooks hooks;
  hooks.loads = true;
  hooks.pace = {step, 1, 1e-12};
  hooks.method = format("statics, load steps of %.6g", step);
  hooks.attach = [this, step](TS ts, TSContext& context) {
    ts_ = ts;
    context_ = &context;
    return attach(ts, context, step);
  };
  hooks.begin = [this] { return begin(); };
  hooks.observe = [this](double factor, Vec y, std::vector<Observable>* out) { return observe(factor, y, out); };
  hooks.final_warnings = [this](Warnings* warnings) { return final_warnings(warnings); };
  hooks.save = [this](Facts* facts) {
    stability_.save(facts);
    snaps_.save(facts);
    start_.save(facts);
    pseudo_.save(facts);
  };
  hooks.restore = [this](const Facts& facts) {
    stability_.restore(facts);
    snaps_.restore(facts);
    start_.restore(facts);
    pseudo_.restore(facts);
    snaps_.begin_at_rest(start_.found());
  };
  hooks.count = [this](std::vector<Tally>* out) { return count(out); };
  if (end_ && end_->wanted()) {
    hooks.tables = [this](PetscMPIInt rank, std::vector<Dataset>* all) {
      if (end_->compliance.wanted()) all->push_back(end_->compliance.table(rank));
      if (end_->moduli.wanted()) end_->moduli.add_tables(rank, all);
    };
  }
  if (box_.active() || (end_ && end_->wanted())) hooks.find = [this](double factor, Vec y, FinalResults* out) { return find(factor, y, out); };
  if (model_.breaks())
    hooks.after_break = [this](double factor, Vec y, const Avalanche::Frame& frame, bool* found, std::string* failure) {
      snaps_.note_break();
      return avalanche_.follow_to_rest(factor, y, frame, found, failure);
    };
  if (!options_.arc) return hooks;
  hooks.pace.end = step * static_cast<double>(options_.arc_steps);
  hooks.method = format("statics by arc length, first step %.6g", step);
  hooks.until = "; KSP";
  hooks.clock = "path";
  hooks.checkpoints = false;
  hooks.done = [this] { return arc_.at_end(); };
  return hooks;
}

PetscErrorCode StaticRun::attach(TS ts, TSContext& context, double step) {
  PetscFunctionBegin;
  context.newton.iterate_to_rounding(true);
  context.examine = [this](double factor, Vec y, StageCheck* out) { return examine(factor, y, out); };
  if (options_.minima && !box_.active()) pseudo_.demand_minima(static_cast<PetscInt>(options_.stability_iterations));
  PetscCall(pseudo_.attach(ts, context, model_, step));
  if (options_.arc) {
    PetscCall(arc_.attach(ts, context, model_, pseudo_, {step, options_.end, options_.lower}));
    PetscFunctionReturn(0);
  }
  if (box_.active()) PetscCall(box_.attach(ts, context, model_, pseudo_));
  else if (pseudo_.is_newton()) PetscCall(snaps_.attach(ts, context, model_, pseudo_));
  PetscFunctionReturn(0);
}

/// To where they were at the start of the step.
PetscErrorCode StaticRun::return_free_bodies(double factor, Vec y) {
  Vec start;
  PetscReal t, h;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts_, &start));
  PetscCall(TSGetTime(ts_, &t));
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(model_.return_free_bodies(options_.arc ? arc_.start_factor() : t, start, factor, h, y));
  PetscFunctionReturn(0);
}

PetscErrorCode StaticRun::begin() {
  PetscFunctionBegin;
  if (start_.tried()) PetscFunctionReturn(0);  // by the run that is continued
  PetscCall(start_.find(ts_, *context_, model_, pseudo_));
  box_.begin_anew();
  snaps_.begin_at_rest(start_.found());
  if (!options_.arc) model_.set_factor(std::numeric_limits<double>::quiet_NaN());
  PetscFunctionReturn(0);
}

/// Where the solver ended by its own test, a shorter load step may be solved better; not where that test was taken from it.
PetscErrorCode StaticRun::examine(double factor, Vec y, StageCheck* out) {
  SNES snes;
  SNESConvergedReason reason;
  PetscFunctionBegin;
  PetscCall(model_.examine(factor, y, &out->failure, &out->hopeless));
  out->good = out->failure.empty();
  if (out->good) PetscCall(return_free_bodies(factor, y));
  if (out->good || out->hopeless) PetscFunctionReturn(0);
  PetscCall(TSGetSNES(ts_, &snes));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  out->hopeless = !ended_by_itself(reason);
  if (out->hopeless) out->failure += format(" (it ended by %s: leave out -snes_atol, -snes_type ksponly and the like)", SNESConvergedReasons[reason]);
  PetscFunctionReturn(0);
}

PetscErrorCode StaticRun::observe(double factor, Vec y, std::vector<Observable>* out) {
  PetscFunctionBegin;
  if (avalanche_.moving()) {
    Stability::skip(out);
    PetscFunctionReturn(0);
  }
  PetscCall(stability_.assess(ts_, context_->matrix, model_, pseudo_, factor, y, out));
  const double s = model_.factor(factor), way = s - last_factor_;
  if (way * last_way_ < 0) ++turns_;
  last_factor_ = s;
  if (way != 0) last_way_ = way;
  PetscFunctionReturn(0);
}

PetscErrorCode StaticRun::find(double factor, Vec y, FinalResults* out) {
  PetscFunctionBegin;
  if (!start_.tried()) PetscFunctionReturn(0);  // nothing has been solved for yet
  if (box_.active()) {
    box_.put(model_, factor, out);
    PetscCall(box_.confirm(model_, factor, y, out));
    if (!out->failure.empty()) PetscFunctionReturn(0);
  }
  if (!end_) PetscFunctionReturn(0);
  if (end_->compliance.wanted()) PetscCall(end_->compliance.find(ts_, context_->matrix, model_, factor, y, out));
  if (end_->moduli.wanted() && out->failure.empty()) PetscCall(end_->moduli.find(ts_, context_->matrix, model_, factor, y, out));
  PetscFunctionReturn(0);
}

PetscErrorCode StaticRun::count(std::vector<Tally>* out) const {
  PetscFunctionBegin;
  start_.count(out);
  out->push_back({"free_bodies", "{body is|bodies are} tied to nothing: {its centre|their centres} of mass stay{s|}, or go{es|} with the box",
                  model_.free_bodies()});
  pseudo_.count(out);
  out->push_back({"box_corrections", "change{s} of the box to meet the stresses of -bs_box_stress", box_.corrections()});
  out->push_back({"turns", "time{s} the load factor turned round: limit point{s}", turns_});
  snaps_.count(options_.arc           ? "along a path by arc length"
               : box_.active()        ? "in a box under given stress"
               : !pseudo_.is_newton() ? "with another -snes_type than newtonls"
                                      : "",
               out);
  out->push_back({"unbalanced", "", model_.unbalanced()});
  stability_.count(out);
  PetscFunctionReturn(0);
}

/// A path is complete where it has come to the load factor that was asked for.
PetscErrorCode StaticRun::final_warnings(Warnings* warnings) {
  PetscFunctionBegin;
  PetscCall(start_.warn(warnings));
  PetscCall(stability_.warn(warnings));
  PetscCall(snaps_.warn(warnings));
  if (const std::int64_t unbalanced = model_.unbalanced(); unbalanced > 0)
    PetscCall(warnings->add("unbalanced_force", format("%s an unbalanced force above 1e-6 of the largest load or reaction "
                                                       "(/observables/unbalanced_force): it bounds their digits",
                                                       how_many(unbalanced, "{equilibrium leaves|equilibria leave}").c_str())));
  if (box_.active()) PetscCall(box_.warn(model_, last_factor_, warnings));
  if (options_.arc && !arc_.at_end())
    PetscCall(warnings->add(
        "path_end",
        format(
            "the path ended at the load factor %.10g, without having come to %.10g (-bs_arc_end): it begins by %s the load factor, and takes at most "
            "%s (-bs_arc_steps)%s",
            last_factor_, options_.end, options_.lower ? "lowering" : "raising", how_many(options_.arc_steps, "whole step").c_str(),
            (options_.end < 0) == options_.lower ? ""
            : options_.lower                     ? "; -bs_arc_begin raise begins the other way"
                                                 : "; -bs_arc_begin lower begins the other way")));
  PetscFunctionReturn(0);
}

// As after a break: no load changes, and what was released so far stays booked.
PetscErrorCode StaticRun::follow(double factor, Vec y, std::string* failure) {
  PetscReal h;
  PC pc;
  bool good = false;
  PetscFunctionBegin;
  failure->clear();
  model_.begin_anew();
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(context_->newton.estimate_floor(1 / h));
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(condensed_renew(pc));
  PetscCall(condensed_reuse_factors(pc, true));  // those of the verdict on the last equilibrium
  PetscCall(avalanche_.relax(factor, y, &good));
  PetscCall(condensed_reuse_factors(pc, false));
  if (good && model_.breaks() && model_.breaks()->broke() > 0)
    PetscCall(avalanche_.follow_to_rest(
        factor, y, [](Vec) -> PetscErrorCode { return 0; }, &good, failure));
  if (!good && failure->empty())
    *failure = format(
        "from the equilibrium at the load factor %.10g none was found with the numbers that are given now: change them in smaller steps", factor);
  PetscFunctionReturn(0);
}

}  // namespace bs
