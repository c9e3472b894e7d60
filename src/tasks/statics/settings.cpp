// The settings of statics from the options, and options of other tasks that it refuses.
#include <string>
#include <utility>
#include <vector>
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "tasks/statics/box_stress.hpp"
#include "tasks/statics/statics.hpp"

namespace bs {

static PetscErrorCode read_loads(MPI_Comm comm, StaticsSettings* out) {
  constexpr std::int64_t MOST_STEPS = 100000000;
  std::vector<std::string> scaled;
  int control = 0, begin = 0;
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
    o.choice("-bs_arc_begin",
             "which way a path by arc length begins: raise, it raises the load factor from 0; lower, it lowers it, towards a negative -bs_arc_end",
             {"raise", "lower"}, begin);
    o.integer("-bs_arc_steps", "number of steps of undiminished length after which a path by arc length ends at the latest", out->arc_steps,
              Range::positive);
    if (out->steps > MOST_STEPS)
      o.fail(format("option -bs_load_steps: %lld: give %lld at most: smaller steps are lost beside the rounding errors of equilibria",
                    static_cast<long long>(out->steps), static_cast<long long>(MOST_STEPS)));
    out->arc = control == 1;
    out->lower = begin == 1;
    if (out->end == 0) o.fail("option -bs_arc_end: the path begins at the load factor 0: give another one");
    const bool given = o.texts("-bs_load_scale",
                               "loads that the load factor multiplies: gravity (uniform and central), anchors and driven "
                               "(prescribed motions, which are where they would be at t = the load factor in seconds), box (the strain of a periodic "
                               "box, likewise), forces (of -bs_force_NAME and of the lattice; expressions and tables likewise), none; the others act "
                               "in full from the start; default: all",
                               scaled);
    if (!given) return;
    out->rules = {false, false, false, false, false};
    for (const std::string& word : scaled) {
      if (word == "gravity") out->rules.gravity = true;
      else if (word == "anchors") out->rules.anchors = true;
      else if (word == "driven") out->rules.driven = true;
      else if (word == "box") out->rules.box = true;
      else if (word == "forces") out->rules.forces = true;
      else if (word != "none") o.fail("option -bs_load_scale: " + word + " is no load: give some of gravity, anchors, driven, box, forces, or none");
    }
  }));
  PetscFunctionReturn(0);
}

/// What follows breaks, and what is asked of every equilibrium.
static PetscErrorCode read_equilibria(MPI_Comm comm, StaticsSettings* out) {
  int follow = 0, kind = out->arc ? 1 : 0;
  AvalancheOptions& after = out->avalanche;
  PetscFunctionBegin;
  PetscCall(read_section(comm, "After a break in statics", [&](Section& o) {
    o.choice("-bs_break_follow",
             "what follows a break at an equilibrium: statics, the next equilibrium of the same loads without inertia; dynamics, the motion that the "
             "break sets going, by backward Euler at constant load, until it has come to rest",
             {"statics", "dynamics"}, follow);
    o.real("-bs_break_dt", "time step of that motion; 0: one over the root mean squared frequency of the lattice [s]", after.step,
           Range::nonnegative);
    o.integer("-bs_break_max_steps", "steps after which a motion that has not come to rest is ended by a search for an equilibrium", after.most,
              Range::positive);
    o.real("-bs_break_output_interval", "time between frames of the motion; 0: none [s]", after.interval, Range::nonnegative);
  }));
  after.dynamics = follow == 1;
  PetscCall(read_section(comm, "Stability of equilibria (-bs_task statics)", [&](Section& o) {
    const bool given =
        o.choice("-bs_equilibria",
                 "which equilibria are looked for: minimum, minima of the energy: where the tangent has negative eigenvalues, the shape "
                 "leaves the saddle point downhill; any, also saddle points, as symmetric structures have beyond their buckling loads; "
                 "default: minimum, by arc length any; boxes under given stress always have any",
                 {"minimum", "any"}, kind);
    if (given && out->arc && kind == 0)
      o.fail("option -bs_equilibria minimum does not go with -bs_load_control arc, whose paths lead through saddle points: leave it out");
    out->minima = kind == 0;
    out->only_minima = given && kind == 0;
    o.integer(
        "-bs_stability_iterations",
        "number of iterations that look for an unstable direction of every equilibrium where the linear solver is iterative; a direct one counts "
        "all of them; 0: none",
        out->stability_iterations, Range::nonnegative);
    if (out->stability_iterations > PETSC_MAX_INT)
      o.fail(format("option -bs_stability_iterations: %lld is too large", static_cast<long long>(out->stability_iterations)));
  }));
  PetscCall(read_section(comm, "Given stresses of a periodic box (-bs_task statics)", [&](Section& o) {
    o.real("-bs_box_stress_rtol",
           "the stresses of -bs_box_stress are met where what is missing is below this times the largest of them, or, where all are 0, times the "
           "largest component there is [1]; at most 1e-6",
           out->box_stress_rtol, Range::positive);
    if (out->box_stress_rtol > BOX_STRESS_MISSED)
      o.fail(format("option -bs_box_stress_rtol: %g: the stresses would not be those given: write 1e-6 or less", out->box_stress_rtol));
  }));
  PetscFunctionReturn(0);
}

/// What is computed at the last equilibrium.
static PetscErrorCode read_final_analyses(MPI_Comm comm, bool moduli, StaticsSettings* out) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Compliance (-bs_task statics)", [&](Section& o) {
    o.texts("-bs_compliance_groups",
            "names of groups whose compliance at the last equilibrium is computed: the mean displacement of each along every axis [m] under a force "
            "of 1 N "
            "on each along every axis, spread evenly over its particles; written to the report and to /compliance of -bs_output",
            out->compliance_groups);
  }));
  if (!moduli) PetscFunctionReturn(0);
  PetscCall(read_section(comm, "Moduli (-bs_task moduli)", [&](Section& o) {
    o.integer("-bs_zero_modes_unknowns",
              "number of unknowns up to which motions without stiffness are counted, by two factorisations with MUMPS; 0: never",
              out->zero_modes_unknowns, Range::nonnegative);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode read_statics_settings(MPI_Comm comm, Analyses analyses, StaticsSettings* out) {
  PetscFunctionBegin;
  PetscCall(read_loads(comm, out));
  PetscCall(read_equilibria(comm, out));
  if (analyses != Analyses::none) PetscCall(read_final_analyses(comm, analyses == Analyses::moduli, out));
  PetscFunctionReturn(0);
}

PetscErrorCode refuse_options_of_dynamics(MPI_Comm comm) {
  const std::pair<const char*, const char*> others[] = {
      {"-ts_type", "there is no time to be stepped: leave it out"},
      {"-ts_dt", "load steps are numbered: give -bs_load_steps"},
      {"-ts_max_time", "the load factor ends at 1: scale the loads themselves"},
      {"-ts_init_time", "the load factor begins at 0: leave it out"},
      {"-ts_adapt_type", "load steps are cut where Newton's method fails: leave it out"},
      {"-bs_stop_at_rest", "every state is at rest: leave it out"},
      {"-mat_type", "the tangent is never assembled as a whole: give -condensed_mat_type"},
  };
  const std::pair<const char*, const char*> switches[] = {
      {"-snes_mf", "the tangent is needed: leave it out"},
      {"-snes_fd", "the tangent is known: leave it out"},
      {"-snes_fd_color", "the tangent is known: leave it out"},
  };
  PetscFunctionBegin;
  const auto refuse = [comm](const char* name, const char* instead) {
    return fail(comm, Exit::input, std::string("option ") + name + " does not go with -bs_task statics: " + instead);
  };
  for (const auto& [name, instead] : others)
    if (is_given(name)) PetscCall(refuse(name, instead));
  for (const auto& [name, instead] : switches) {
    bool on = false;
    PetscCall(is_on(name, &on));
    if (on) PetscCall(refuse(name, instead));
  }
  const std::string type = value_of("-pc_type", "condensed");
  if (type != "condensed")
    PetscCall(fail(comm, Exit::input,
                   "option -pc_type " + type +
                       " does not go with -bs_task statics: choose the linear solver by -condensed_pc_type and "
                       "-condensed_ksp_type"));
  PetscFunctionReturn(0);
}

PetscErrorCode refuse_checkpoints(MPI_Comm comm) {
  PetscFunctionBegin;
  for (const char* name : {"-bs_checkpoint", "-bs_restart"})
    if (is_given(name))
      PetscCall(fail(comm, Exit::input,
                     std::string("option ") + name + " does not go with -bs_load_control arc: a path cannot be continued; leave it out"));
  PetscFunctionReturn(0);
}

}  // namespace bs
