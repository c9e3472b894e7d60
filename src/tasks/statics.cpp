#include "tasks/statics.hpp"
#include <algorithm>
#include <string>
#include "base/fault.hpp"
#include "base/options.hpp"
#include "solvers/arc_length.hpp"
#include "solvers/condensed/condensed.hpp"
#include "solvers/pseudo_time.hpp"
#include "systems/equilibrium.hpp"
#include "tasks/matrices.hpp"
#include "tasks/run_parts.hpp"
#include "time/ts_queries.hpp"

namespace bs {
namespace {

struct LoadOptions {
  std::int64_t steps = 1, arc_steps = 1000;
  bool arc = false;
  double end = 1;
  LoadRules rules;
};

PetscErrorCode read_load_options(MPI_Comm comm, LoadOptions* out) {
  std::vector<std::string> scaled;
  int control = 0;
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Loads (-bs_task statics)", [&](Section& o) {
    o.integer("-bs_load_steps", "number of load steps from the load factor 0 to 1; by arc length, 1 over what the first step adds", out->steps,
              Range::positive);
    o.choice(
        "-bs_load_control",
        "what is given of a load step: load, its load factor; arc, the length of its way in positions and load factor, so that the load factor may "
        "fall beyond a limit load",
        {"load", "arc"}, control);
    o.real("-bs_arc_end", "load factor at which a path by arc length ends [1]", out->end);
    o.integer("-bs_arc_steps", "number of steps of undiminished length after which a path by arc length ends at the latest", out->arc_steps,
              Range::positive);
    out->arc = control == 1;
    if (out->end == 0) o.fail("option -bs_arc_end: the path begins at the load factor 0: give another one");
    const bool given = o.texts("-bs_load_scale",
                               "loads that the load factor multiplies: gravity (uniform and central), anchors and driven "
                               "(prescribed motions, which are where they would be at t = the load factor in seconds), none; the others act in full "
                               "from the start; default: all",
                               scaled);
    if (!given) return;
    out->rules = {false, false, false};
    for (const std::string& word : scaled) {
      if (word == "gravity") out->rules.gravity = true;
      else if (word == "anchors") out->rules.anchors = true;
      else if (word == "driven") out->rules.driven = true;
      else if (word != "none") o.fail("option -bs_load_scale: " + word + " is no load: give some of gravity, anchors, driven, or none");
    }
  }));
  PetscFunctionReturn(0);
}

/// Options of time stepping and of solvers that have no meaning here.
PetscErrorCode refuse_options_of_dynamics(MPI_Comm comm) {
  const std::pair<const char*, const char*> others[] = {
      {"-ts_type", "there is no time to be stepped: leave it out"},
      {"-ts_dt", "load steps are numbered: give -bs_load_steps"},
      {"-ts_max_time", "the load factor ends at 1: scale the loads themselves"},
      {"-ts_init_time", "the load factor begins at 0: leave it out"},
      {"-ts_adapt_type", "load steps are cut where Newton's method fails: leave it out"},
      {"-bs_stop_at_rest", "every state is at rest: leave it out"},
      {"-snes_mf", "the tangent is needed: leave it out"},
      {"-snes_fd", "the tangent is known: leave it out"},
      {"-snes_fd_color", "the tangent is known: leave it out"},
      {"-mat_type", "the tangent is never assembled as a whole: give -condensed_mat_type"},
  };
  PetscFunctionBegin;
  for (const auto& [name, instead] : others) {
    PetscBool given = PETSC_FALSE;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, name, &given));
    if (given) PetscCall(tell(comm, Exit::input, std::string("option ") + name + " does not go with -bs_task statics: " + instead));
  }
  char type[64] = "condensed";
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-pc_type", type, sizeof type, nullptr));
  if (std::string(type) != "condensed")
    PetscCall(tell(comm, Exit::input,
                   std::string("option -pc_type ") + type +
                       " does not go with -bs_task statics: choose the linear solver by -condensed_pc_type and "
                       "-condensed_ksp_type"));
  PetscFunctionReturn(0);
}

/// The tangent and the length of the path are not kept in files.
PetscErrorCode refuse_checkpoints(MPI_Comm comm) {
  PetscFunctionBegin;
  for (const char* name : {"-bs_checkpoint", "-bs_restart"}) {
    PetscBool given = PETSC_FALSE;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, name, &given));
    if (given)
      PetscCall(tell(comm, Exit::input,
                     std::string("option ") + name + " does not go with -bs_load_control arc: a path cannot be continued; leave it out"));
  }
  PetscFunctionReturn(0);
}

/// What statics adds to a run: load steps for time steps, the fallback, and the signs of the tangent's pivots.
class StaticRun {
 public:
  StaticRun(Equilibrium& model, const LoadOptions& options) : model_(model), options_(options) {}
  RunHooks hooks();

 private:
  PetscErrorCode observe(double factor, Vec y, std::vector<Observable>* out);
  PetscErrorCode count(std::vector<Tally>* out) const;

  Equilibrium& model_;
  LoadOptions options_;
  PseudoTime pseudo_;
  ArcLength arc_;
  TS ts_ = nullptr;
  TSContext* context_ = nullptr;
  std::int64_t unstable_ = 0;  ///< equilibria whose tangent had some
  PetscInt before_ = -1;       ///< negative pivots at the last equilibrium; -1: not known
  std::int64_t changes_ = 0;   ///< of their number, from one equilibrium to the next
  std::int64_t turns_ = 0;     ///< times the load factor began to fall or to rise
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
    return options_.arc ? arc_.attach(ts, context, model_, step, options_.end) : pseudo_.attach(ts, context, model_, step);
  };
  hooks.observe = [this](double factor, Vec y, std::vector<Observable>* out) { return observe(factor, y, out); };
  hooks.count = [this](std::vector<Tally>* out) { return count(out); };
  if (!options_.arc) return hooks;
  hooks.pace.end = step * static_cast<double>(options_.arc_steps);
  hooks.method = format("statics by arc length, first step %.6g", step);
  hooks.until = "; KSP";
  hooks.clock = "path";
  hooks.checkpoints = false;
  hooks.done = [this] { return arc_.at_end(); };
  return hooks;
}

/// The tangent at the equilibrium itself: Newton's last one is of the iterate before it.
PetscErrorCode StaticRun::observe(double factor, Vec y, std::vector<Observable>* out) {
  PC pc;
  PetscInt negative = -1;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(model_.linearise_sharply(factor, y, context_->matrix));
  PetscCall(condensed_negative_pivots(pc, &negative));
  if (negative > 0 && factor > 0) ++unstable_;
  if (before_ >= 0 && negative != before_) ++changes_;
  before_ = negative;
  const double s = model_.factor(factor), way = s - last_factor_;
  if (way * last_way_ < 0) ++turns_;
  last_factor_ = s;
  if (way != 0) last_way_ = way;
  out->push_back({"negative_pivots", {static_cast<double>(negative)}});
  PetscFunctionReturn(0);
}

PetscErrorCode StaticRun::count(std::vector<Tally>* out) const {
  PetscFunctionBegin;
  out->push_back({"free_bodies", "bodies are tied to nothing: their rigid motions stay as they are", model_.free_bodies()});
  out->push_back({"pseudo_transient",
                  "load steps ended by pseudo-transient continuation, where Newton's method had failed: the shape may have jumped",
                  pseudo_.solves()});
  out->push_back({"turns", "times the load factor turned round: limit points", turns_});
  out->push_back({"inertia_changes", "times the number of negative pivots changed: limit points and branch points lie there", changes_});
  out->push_back({"unstable", "equilibria are unstable: the tangent there has negative pivots", unstable_});
  PetscFunctionReturn(0);
}

/// The model of equilibria of `model`, whose loads may have them.
PetscErrorCode prepare(std::unique_ptr<Model> model, const LoadOptions& loads, RunOptions* options, std::unique_ptr<Equilibrium>* out) {
  PetscFunctionBegin;
  if (!model->tangent())
    PetscCall(tell(model->comm(), Exit::input,
                   model->mechanics() ? "-bs_task statics: a force that couples all particles has no tangent of its own: leave the force out"
                                      : "-bs_task statics: a linear system has no equilibria under loads: leave -bs_task out"));
  *out = std::make_unique<Equilibrium>(model->take_mechanics(), loads.rules);
  PetscCall((*out)->begin());
  options->advise = false;
  options->energy_growth = 0;
  PetscFunctionReturn(0);
}

/// The run; `last` receives the state of the last frame, an equilibrium, or null under -help.
PetscErrorCode run_loads(Equilibrium& equilibrium, const RunOptions& options, const LoadOptions& loads, VecHandle* last, int* exit_code) {
  PetscFunctionBegin;
  StaticRun statics(equilibrium, loads);
  RunHooks hooks = statics.hooks();
  const auto observe = hooks.observe;
  hooks.observe = [&observe, last](double factor, Vec y, std::vector<Observable>* out) {
    PetscFunctionBegin;
    PetscCall(observe(factor, y, out));
    if (!*last) PetscCall(VecDuplicate(y, last->out()));
    PetscCall(VecCopy(y, *last));
    PetscFunctionReturn(0);
  };
  Run run(equilibrium, options, hooks);
  PetscCall(run.set_up());
  PetscCall(run.advance(exit_code));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode run_statics(std::unique_ptr<Model> model, int* exit_code) {
  RunOptions options;
  LoadOptions loads;
  Claim claim;  // given up when the files are closed
  std::unique_ptr<Equilibrium> equilibrium;
  VecHandle last, rest;
  PetscFunctionBegin;
  const MPI_Comm comm = model->comm();
  PetscCall(read_load_options(comm, &loads));
  PetscCall(refuse_options_of_dynamics(comm));
  if (loads.arc) PetscCall(refuse_checkpoints(comm));
  PetscCall(read_run_options(comm, &options));
  PetscCall(prepare(std::move(model), loads, &options, &equilibrium));
  PetscCall(claim_files(comm, options, &claim));
  PetscCall(run_loads(*equilibrium, options, loads, &last, exit_code));
  if (!last) PetscFunctionReturn(0);
  PetscCall(at_rest(last, rest.out()));
  PetscCall(write_matrices(*equilibrium, equilibrium->factor(1), rest, options.output.trajectory.overwrite));
  PetscFunctionReturn(0);
}

PetscErrorCode settle(std::unique_ptr<Model> model, const RunOptions& given, std::unique_ptr<Model>* settled, Vec* y, int* exit_code) {
  RunOptions options = given;
  LoadOptions loads;
  std::unique_ptr<Equilibrium> equilibrium;
  VecHandle last;
  PetscFunctionBegin;
  const MPI_Comm comm = model->comm();
  PetscCall(read_load_options(comm, &loads));
  PetscCall(refuse_options_of_dynamics(comm));
  PetscCall(prepare(std::move(model), loads, &options, &equilibrium));
  options.output.trajectory.file.clear();
  options.output.report.clear();
  PetscCall(run_loads(*equilibrium, options, loads, &last, exit_code));
  PetscCall(at_rest(last ? last.get() : equilibrium->initial_state(), y));
  *settled = std::move(equilibrium);
  PetscFunctionReturn(0);
}

}  // namespace bs
