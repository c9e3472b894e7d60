#include "tasks/statics/rest_start.hpp"
#include <utility>
#include "base/handle.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "time/methods.hpp"
#include "time/starter.hpp"

namespace bs {
namespace {

/// Newton iterations in a row without progress after which it is given up.
constexpr int IDLE = 15;

/// A stage of `ts` that counts as solved for, whatever y is: its residual knows where the step starts and how long it is.
PetscErrorCode make_stage(TS ts, TSContext& context, double h, Vec y) {
  Replay stage;
  PetscFunctionBegin;
  const auto examine = std::exchange(context.examine, nullptr);
  PetscCall(stage.begin(ts));
  PetscCall(stage.step(0, h, y, nullptr, y));
  PetscCall(stage.end(0, h));
  context.examine = examine;
  PetscFunctionReturn(0);
}

PetscErrorCode copy_velocities(Vec from, Vec to) {
  PetscFunctionBegin;
  const ReadArray a(from);
  const WriteArray b(to);
  layout_of(to).for_each([&](PetscInt, PetscInt v) { b[v] = a[v]; });
  PetscFunctionReturn(0);
}

}  // namespace

// No path is left here, as between load steps: pseudo time begins once Newton's iteration gets nowhere. (Nets of 900 particles whose springs all push
// take 60 to 80 iterations to see that, where -snes_max_it is 150; those that converge make progress at least every eleventh.)
PetscErrorCode RestStart::find(TS ts, TSContext& context, Equilibrium& model, PseudoTime& solver) {
  Vec y;
  VecHandle given;
  HeldEnergies had;
  PetscReal h;
  PetscInt before = 0, after = 0;
  PC pc;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(copy_into(&given, y));
  model.set_factor(0);
  PetscCall(model.energies(0, y, &had));  // a box whose strains are free is another afterwards
  PetscCall(make_stage(ts, context, h, y));
  PetscCall(context.newton.estimate_floor(1 / h));
  PetscCall(TSGetSNESIterations(ts, &before));
  context.newton.give_up_after(IDLE);
  PetscCall(solver.relax(y, &found_));
  context.newton.give_up_after(0);
  PetscCall(TSGetSNESIterations(ts, &after));
  tried_ = true;
  iterations_ = after - before;
  if (found_) {
    PetscCall(copy_velocities(given, y));
    PetscCall(model.begin_at(0, y, had));
  }
  // the first load step begins as if nothing had been
  model.set_fault("");
  context.newton.forget_lengths();
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_renew(pc));
  PetscFunctionReturn(0);
}

void RestStart::count(std::vector<Tally>* out) const {
  out->push_back({"start_newton",
                  found_ ? "Newton iteration{s} brought the lattice, as it was given, to rest at the load factor 0"
                         : "Newton iteration{s} looked in vain for an equilibrium at the load factor 0",
                  iterations_});
}

PetscErrorCode RestStart::warn(Warnings* warnings) const {
  PetscFunctionBegin;
  if (!tried_ || found_) PetscFunctionReturn(0);
  PetscCall(
      warnings->add("start_not_at_rest",
                    "no equilibrium of the lattice was found at the load factor 0: the first load step starts from the lattice as it is given, and "
                    "what it releases is in no sum of energies"));
  PetscFunctionReturn(0);
}

void RestStart::save(Facts* facts) const {
  facts->whole["start_tried"] = tried_ ? 1 : 0;
  facts->whole["start_at_rest"] = found_ ? 1 : 0;
}

void RestStart::restore(const Facts& facts) {
  tried_ = facts.whole_of("start_tried") != 0;
  found_ = facts.whole_of("start_at_rest") != 0;
}

}  // namespace bs
