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

using PartRows = std::vector<std::vector<double>>;

static PartRows rows_of(const std::vector<StatePart>& parts) {
  PartRows all(parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const ReadArray a(parts[k].vec);
    PetscInt size = 0;
    (void)VecGetLocalSize(parts[k].vec, &size);
    all[k].assign(a.data(), a.data() + size);
  }
  return all;
}

static void copy_to(const std::vector<StatePart>& parts, const PartRows& rows) {
  for (std::size_t k = 0; k < parts.size(); ++k) copy_to(parts[k].vec, rows[k]);
}

static bool same_sizes(const std::vector<StatePart>& parts, const PartRows& rows) {
  const auto same = [](const StatePart& part, const std::vector<double>& own) {
    PetscInt size = 0;
    (void)VecGetLocalSize(part.vec, &size);
    return static_cast<std::size_t>(size) == own.size();
  };
  return parts.size() == rows.size() && std::equal(parts.begin(), parts.end(), rows.begin(), same);
}

PetscErrorCode Session::Impl::save(State* out) {
  Vec y;
  VecHandle shown;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(begin());
  PetscCall(run->state_vector(&y));
  out->time = run->time();
  out->steps = steps_so_far();
  out->number = ++saved;
  out->made_of = made_of;
  out->changed = changed;
  out->removed = removed;
  PetscCall(model->gather_state(y, &parts));
  out->y = rows_of(parts);
  if (model->mechanics()) {
    PetscCall(copy_into(&shown, y));
    PetscCall(model->mechanics()->place_held(out->time, shown));
    PetscCall(model->gather_state(shown, &parts));
    out->shown = rows_of(parts);
  }
  PetscCall(model->gather_memory(&parts));
  out->memory = rows_of(parts);
  model->save_sums(&out->sums);
  PetscFunctionReturn(0);
}

/// Whether it is one of this system on these ranks, and the same one on all.
PetscErrorCode Session::Impl::check_state(const State& state) {
  Error error;
  std::vector<StatePart> parts;
  std::int64_t most[2] = {state.number, -state.number};
  PetscFunctionBegin;
  PetscCall(model->gather_state(model->initial_state(), &parts));
  bool fits = state.made_of == made_of && same_sizes(parts, state.y) && state.shown.empty() == (model->mechanics() == nullptr);
  PetscCall(model->gather_memory(&parts));
  fits = fits && same_sizes(parts, state.memory);
  PetscCall(max_over_ranks(comm, most, 2));
  if (!fits)
    error.note(0, "the state is of another lattice, of other laws or of another number of ranks: give one that was saved of the same lattice");
  else if (most[0] != -most[1])
    error.note(0, "the states that the ranks give are not of one moment: give on every rank what one save() has returned");
  PetscCall(fail_if_any(comm, error));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::restore(const State& state) {
  VecHandle shown;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(open());
  PetscCall(refuse_files());
  PetscCall(check_state(state));
  PetscCall(VecDuplicate(model->initial_state(), given_state.out()));
  PetscCall(model->gather_state(model->initial_state(), &parts));  // for their vectors, as below
  copy_to(parts, state.y);
  PetscCall(model->scatter_state(given_state));
  PetscCall(start_anew(state.time, state.steps));
  PetscCall(restore_numbers(state));
  PetscCall(model->gather_memory(&parts));
  copy_to(parts, state.memory);
  if (!parts.empty()) PetscCall(model->scatter_memory());
  model->restore_sums(state.sums);
  if (!state.shown.empty()) {
    PetscCall(VecDuplicate(given_state, shown.out()));
    PetscCall(model->gather_state(given_state, &parts));
    copy_to(parts, state.shown);
    PetscCall(model->scatter_state(shown));
    PetscCall(model->mechanics()->give_motion("", state.time, state.time, shown));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
