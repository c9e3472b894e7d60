// States of a session that are set, saved, restored, and motions that are given to it.
#include <petscts.h>
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/option_names.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "session/session_impl.hpp"
#include "systems/mechanics.hpp"

namespace bs {

PetscErrorCode Session::Impl::require_particles() {
  PetscFunctionBegin;
  if (!model->mechanics()) PetscCall(fail(comm, Exit::input, std::string("a ") + model->name() + " system has no particles"));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::refuse_files() {
  PetscFunctionBegin;
  for (const char* const file : {"-bs_output", "-bs_report", "-bs_checkpoint"})
    if (is_given(file))
      PetscCall(fail(comm, Exit::input, format("option %s: the file of a run has no place for a state that is set: leave it out", file)));
  PetscFunctionReturn(0);
}

static void copy_to(Vec v, const std::vector<double>& numbers) { std::copy(numbers.begin(), numbers.end(), WriteArray(v).data()); }

/// Numbers of this rank's rows.
PetscErrorCode Session::Impl::check_rows(const std::vector<double>& rows) {
  Error error;
  PetscFunctionBegin;
  if (rows.size() != static_cast<std::size_t>(particles.count * model->dim()))
    error.note(particles.first,
               format("%zu numbers for %lld particles in %d dimensions", rows.size(), static_cast<long long>(particles.count), model->dim()));
  for (std::size_t k = 0; k < rows.size() && !error; ++k)
    if (!std::isfinite(rows[k]))
      error.note(
          particles.first + static_cast<std::int64_t>(k) / model->dim(),
          format("row %lld is not finite: give numbers", static_cast<long long>(particles.first + static_cast<std::int64_t>(k) / model->dim())));
  PetscCall(fail_if_any(comm, error));
  PetscFunctionReturn(0);
}

/// Components that are held have in `y` what they have in `before`.
static void keep_held(Mechanics& mechanics, Vec before, Vec y) {
  const Layout& at = mechanics.layout();
  const Linearisation& free = mechanics.linearisation();
  const ReadArray was(before);
  const WriteArray a(y);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c)
      if (!free.moves(i, c))
        for (const PetscInt k : {at.x(i, c), at.v(i, c)}) a[k] = was[k];
}

/// The state with other positions or velocities, from which a run of its own begins.
PetscErrorCode Session::Impl::set(Array what, const std::vector<double>& rows) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(open());
  PetscCall(require_particles());
  if (what == Array::force || what == Array::reaction) PetscCall(fail(comm, Exit::input, "forces follow from positions and velocities: set these"));
  PetscCall(refuse_files());
  PetscCall(check_rows(rows));
  PetscCall(hold_state());
  PetscCall(model->gather_state(given_state, &parts));
  copy_to(parts[what == Array::position ? 0 : 1].vec, rows);
  VecHandle before;
  PetscCall(copy_into(&before, given_state));
  PetscCall(model->scatter_state(given_state));
  keep_held(*model->mechanics(), before, given_state);
  PetscFunctionReturn(0);
}

/// The present run ends; the next one begins at `time`, with given_state and a method without history.
PetscErrorCode Session::Impl::start_anew(double time, std::int64_t steps) {
  PetscFunctionBegin;
  start = time;
  earlier_steps = steps;
  PetscCall(PetscOptionsSetValue(nullptr, "-ts_init_time", format("%.17g", start).c_str()));
  PetscCall(PetscOptionsClearValue(nullptr, "-bs_restart"));
  run.reset();
  locks.reset();
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::drive(const std::string& group, double t, const std::vector<double>& rows) {
  Vec y;
  VecHandle places;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(begin());
  PetscCall(require_particles());
  PetscCall(check_rows(rows));
  if (group.empty()) PetscCall(fail(comm, Exit::input, "a group without a name: name one whose motion is given"));
  if (!(t > run->time()) || !std::isfinite(t))
    PetscCall(
        fail(comm, Exit::input, format("a motion to the time %g s, which is not after the present one, %g s: give a later time", t, run->time())));
  PetscCall(run->state_vector(&y));
  PetscCall(VecDuplicate(y, places.out()));
  PetscCall(model->gather_state(y, &parts));
  copy_to(parts[0].vec, rows);
  PetscCall(model->scatter_state(places));
  PetscCall(model->mechanics()->give_motion(group, run->time(), t, places));
  PetscFunctionReturn(0);
}

static std::vector<double> numbers_of(Vec v) {
  const ReadArray a(v);
  PetscInt size = 0;
  (void)VecGetLocalSize(v, &size);
  return {a.data(), a.data() + size};
}

PetscErrorCode Session::Impl::save(State* out) {
  Vec y;
  VecHandle shown;
  std::vector<StatePart> memory;
  PetscFunctionBegin;
  PetscCall(begin());
  PetscCall(run->state_vector(&y));
  out->time = run->time();
  out->steps = steps_so_far();
  out->y = numbers_of(y);
  if (model->mechanics()) {
    PetscCall(copy_into(&shown, y));
    PetscCall(model->mechanics()->place_held(out->time, shown));
    out->shown = numbers_of(shown);
  }
  PetscCall(model->gather_memory(&memory));
  for (const StatePart& part : memory) out->memory.push_back(numbers_of(part.vec));
  model->save_sums(&out->sums);
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::restore(const State& state) {
  VecHandle shown;
  std::vector<StatePart> memory;
  PetscFunctionBegin;
  PetscCall(open());
  PetscCall(refuse_files());
  PetscCall(VecDuplicate(model->initial_state(), given_state.out()));
  copy_to(given_state, state.y);
  PetscCall(start_anew(state.time, state.steps));
  PetscCall(model->gather_memory(&memory));  // for their vectors
  for (std::size_t k = 0; k < memory.size() && k < state.memory.size(); ++k) copy_to(memory[k].vec, state.memory[k]);
  if (!memory.empty()) PetscCall(model->scatter_memory());
  model->restore_sums(state.sums);
  if (!state.shown.empty()) {
    PetscCall(VecDuplicate(given_state, shown.out()));
    copy_to(shown, state.shown);
    PetscCall(model->mechanics()->give_motion("", state.time, state.time, shown));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
