#include "tasks/statics/statics.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "systems/breaks.hpp"
#include "systems/equilibrium.hpp"
#include "systems/frame_rows.hpp"
#include "tasks/compliance.hpp"
#include "tasks/matrices.hpp"
#include "tasks/moduli.hpp"
#include "tasks/run.hpp"
#include "tasks/statics/arc_length.hpp"
#include "tasks/statics/avalanche.hpp"
#include "tasks/statics/box_stress.hpp"
#include "tasks/statics/pseudo_time.hpp"
#include "tasks/statics/rest_start.hpp"
#include "tasks/statics/snap_through.hpp"
#include "tasks/statics/stability.hpp"

namespace bs {
namespace {

/// What is computed at the last equilibrium, where it is wanted.
struct FinalAnalyses {
  Compliance compliance;
  Moduli moduli;
  bool wanted() const { return compliance.wanted() || moduli.wanted(); }
};

/// What statics adds to a run: load steps for time steps, the fallback, and the signs of the tangent's pivots.
class StaticRun {
 public:
  StaticRun(Equilibrium& model, const StaticsSettings& options, FinalAnalyses* end)
      : model_(model), options_(options), end_(end), stability_(options.stability_iterations), avalanche_(model, pseudo_, options.avalanche) {}
  PetscErrorCode begin_box() { return box_.begin(model_, options_); }
  RunHooks hooks();

 private:
  PetscErrorCode attach(TS ts, TSContext& context, double step);
  PetscErrorCode begin();
  PetscErrorCode examine(double factor, Vec y, StageCheck* out);
  PetscErrorCode return_free_bodies(double factor, Vec y);
  PetscErrorCode observe(double factor, Vec y, std::vector<Observable>* out);
  PetscErrorCode count(std::vector<Tally>* out) const;
  PetscErrorCode find(double factor, Vec y, FinalResults* out);
  PetscErrorCode final_warnings(Warnings* warnings);

  Equilibrium& model_;
  StaticsSettings options_;
  FinalAnalyses* end_;  ///< null: nothing is wanted
  BoxStress box_;
  PseudoTime pseudo_;
  RestStart start_;
  ArcLength arc_;
  SnapThrough snaps_;
  Stability stability_;
  Avalanche avalanche_;
  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  std::int64_t turns_ = 0;  ///< times the load factor began to fall or to rise
  double last_factor_ = 0, last_way_ = 0;
};

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
  if (box_.active()) PetscCall(box_.attach(ts, context, model_, [this](SNES snes) { return pseudo_.solve(snes); }));
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
  PetscCall(stability_.assess(ts_, context_->matrix, model_, factor, y, out));
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

/// The model of equilibria of `model`, whose loads may have them.
PetscErrorCode prepare(std::unique_ptr<Model> model, const StaticsSettings& loads, RunOptions* options, std::unique_ptr<Equilibrium>* out) {
  PetscFunctionBegin;
  if (!model->tangent())
    PetscCall(fail(model->comm(), Exit::input,
                   model->mechanics() ? "-bs_task statics: a force that couples all particles has no tangent of its own: leave the force out"
                                      : "-bs_task statics: a linear system has no equilibria under loads: leave -bs_task out"));
  *out = std::make_unique<Equilibrium>(model->take_mechanics(), loads.rules);
  PetscCall((*out)->begin());
  options->advise = false;
  options->energy_growth = 0;
  PetscFunctionReturn(0);
}

/// The run; `last` receives the state of the last frame, an equilibrium, or null under -help; `found`, unless null, its load factor, what is observed
/// of it, counts and the outcome.
PetscErrorCode run_loads(Equilibrium& equilibrium, const RunOptions& options, const StaticsSettings& loads, FinalAnalyses* end, VecHandle* last,
                         FoundEquilibrium* found, int* exit_code) {
  PetscFunctionBegin;
  StaticRun statics(equilibrium, loads, end);
  PetscCall(statics.begin_box());
  RunHooks hooks = statics.hooks();
  hooks.only_run = end != nullptr;
  hooks.on_step = held_by<LoadStepObserver>(equilibrium.comm()).on_step;
  const auto observe = hooks.observe;
  hooks.observe = [&observe, last, found](double factor, Vec y, std::vector<Observable>* out) {
    PetscFunctionBegin;
    if (found) found->factor = factor;
    PetscCall(observe(factor, y, out));
    if (found) found->observables = *out;
    if (!*last) PetscCall(VecDuplicate(y, last->out()));
    PetscCall(VecCopy(y, *last));
    PetscFunctionReturn(0);
  };
  if (found)
    hooks.concluded = [found](const std::string& outcome, const std::string& why) {
      found->outcome = outcome;
      found->why = why;
    };
  Run run(equilibrium, options, hooks);
  PetscCall(run.set_up());
  const PetscErrorCode code = run.advance(exit_code);
  if (found) found->counts = run.counts();
  PetscFunctionReturn(code);
}

/// The last equilibrium for a program that asks for it.
PetscErrorCode copy_equilibrium(Equilibrium& equilibrium, const FoundEquilibrium& found, Vec last, Result* out) {
  PetscFunctionBegin;
  out->load_factor = equilibrium.factor(found.factor);
  out->steps = found.counts.steps;
  out->rejected = found.counts.rejected;
  out->newton = found.counts.newton;
  out->krylov = found.counts.krylov;
  out->frame.time = found.factor;
  out->frame.observables = found.observables;
  PetscCall(read_tables(equilibrium, found.factor, last, &out->frame.tables));
  PetscCall(read_breaks(equilibrium, &out->frame.breaks));
  PetscFunctionReturn(0);
}

}  // namespace

/// `moduli`: they are found, too.
static PetscErrorCode run_equilibria(std::unique_ptr<Model> model, bool moduli, Result* result, int* exit_code) {
  RunOptions options;
  StaticsSettings loads;
  OutputLocks locks;  // given up when the files are closed
  std::unique_ptr<Equilibrium> equilibrium;
  FinalAnalyses end;
  FoundEquilibrium found;
  VecHandle last, rest;
  PetscFunctionBegin;
  MPI_Comm comm = model->comm();
  PetscCall(read_statics_settings(comm, moduli ? Analyses::moduli : Analyses::compliance, &loads));
  PetscCall(refuse_options_of_dynamics(comm));
  if (loads.arc) PetscCall(refuse_checkpoints(comm));
  if (loads.arc && model->breaks())
    PetscCall(fail(comm, Exit::input, "-bs_load_control arc: springs that break are for load steps: leave the option out, or the limits of springs"));
  PetscCall(read_run_options(comm, Steps::loads, &options));
  PetscCall(prepare(std::move(model), loads, &options, &equilibrium));
  PetscCall(end.compliance.begin(*equilibrium, loads.compliance_groups));
  if (moduli && !is_given("-help")) PetscCall(end.moduli.begin(*equilibrium, loads.zero_modes_unknowns));
  PetscCall(lock_outputs(comm, options, &locks));
  const PetscErrorCode code = run_loads(*equilibrium, options, loads, &end, &last, &found, exit_code);
  if (result && last && !found.outcome.empty()) PetscCall(copy_equilibrium(*equilibrium, found, last, result));
  if (code || !last || *exit_code != 0) PetscFunctionReturn(code);  // a run that was stopped has not come to the last equilibrium
  PetscCall(at_rest(last, rest.out()));
  PetscCall(write_matrices(*equilibrium, equilibrium->factor(1), rest, options.output.trajectory.overwrite));
  if (result && moduli) end.moduli.copy_results(result);
  PetscFunctionReturn(0);
}

PetscErrorCode run_statics(std::unique_ptr<Model> model, Result* result, int* exit_code) {
  return run_equilibria(std::move(model), false, result, exit_code);
}

PetscErrorCode run_moduli(std::unique_ptr<Model> model, Result* result, int* exit_code) {
  return run_equilibria(std::move(model), true, result, exit_code);
}

PetscErrorCode find_equilibrium(std::unique_ptr<Model> model, const RunOptions& given, FoundEquilibrium* out, int* exit_code) {
  RunOptions options = given;
  StaticsSettings loads;
  std::unique_ptr<Equilibrium> equilibrium;
  VecHandle last;
  PetscFunctionBegin;
  MPI_Comm comm = model->comm();
  PetscCall(read_statics_settings(comm, Analyses::none, &loads));
  PetscCall(refuse_options_of_dynamics(comm));
  PetscCall(prepare(std::move(model), loads, &options, &equilibrium));
  options.output.trajectory.file.clear();
  options.output.report.clear();
  options.keep_input = true;
  PetscErrorCode code = run_loads(*equilibrium, options, loads, nullptr, &last, out, exit_code);
  const double load = equilibrium->factor(out->factor), full = loads.arc ? loads.end : 1.0;
  if (code == 0 && out->outcome == "ok" && std::abs(load - full) > 1e-9 * std::max(1.0, std::abs(full))) {
    out->outcome = "failed";
    out->why =
        format("no equilibrium under the full loads was come to: the load factor is %.10g of %g: give more steps (-ts_max_steps, -bs_arc_steps)",
               load, full);
    code = fail(comm, Exit::solve, out->why);
  }
  if (code != 0 && (code != ERR_FAILED || out->outcome.empty())) PetscFunctionReturn(code);
  PetscCall(at_rest(last ? last.get() : equilibrium->initial_state(), out->y.out()));
  if (out->outcome == "ok" || out->outcome.empty()) out->factor = 1;
  out->model = std::move(equilibrium);
  PetscFunctionReturn(code);
}

}  // namespace bs
