#include <string>
#include <utility>
#include <vector>
#include "base/error.hpp"
#include "base/options.hpp"
#include "tasks/statics/statics.hpp"

namespace bs {

PetscErrorCode read_load_options(MPI_Comm comm, LoadOptions* out) {
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
                               "box, likewise), none; the "
                               "others act in full "
                               "from the start; default: all",
                               scaled);
    if (!given) return;
    out->rules = {false, false, false, false};
    for (const std::string& word : scaled) {
      if (word == "gravity") out->rules.gravity = true;
      else if (word == "anchors") out->rules.anchors = true;
      else if (word == "driven") out->rules.driven = true;
      else if (word == "box") out->rules.box = true;
      else if (word != "none") o.fail("option -bs_load_scale: " + word + " is no load: give some of gravity, anchors, driven, box, or none");
    }
  }));
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
      {"-snes_mf", "the tangent is needed: leave it out"},
      {"-snes_fd", "the tangent is known: leave it out"},
      {"-snes_fd_color", "the tangent is known: leave it out"},
      {"-mat_type", "the tangent is never assembled as a whole: give -condensed_mat_type"},
  };
  PetscFunctionBegin;
  for (const auto& [name, instead] : others) {
    PetscBool given = PETSC_FALSE;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, name, &given));
    if (given) PetscCall(fail(comm, Exit::input, std::string("option ") + name + " does not go with -bs_task statics: " + instead));
  }
  char type[64] = "condensed";
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-pc_type", type, sizeof type, nullptr));
  if (std::string(type) != "condensed")
    PetscCall(fail(comm, Exit::input,
                   std::string("option -pc_type ") + type +
                       " does not go with -bs_task statics: choose the linear solver by -condensed_pc_type and "
                       "-condensed_ksp_type"));
  PetscFunctionReturn(0);
}

PetscErrorCode refuse_checkpoints(MPI_Comm comm) {
  PetscFunctionBegin;
  for (const char* name : {"-bs_checkpoint", "-bs_restart"}) {
    PetscBool given = PETSC_FALSE;
    PetscCall(PetscOptionsHasName(nullptr, nullptr, name, &given));
    if (given)
      PetscCall(fail(comm, Exit::input,
                     std::string("option ") + name + " does not go with -bs_load_control arc: a path cannot be continued; leave it out"));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
