// States of a session that are set, saved, restored, and motions that are given to it.
#include <petscts.h>
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/handle.hpp"
#include "base/option_names.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "checkpoint/checkpoint.hpp"
#include "session/session_impl.hpp"
#include "systems/client.hpp"
#include "systems/mechanics.hpp"

namespace bs {

PetscErrorCode Session::Impl::require_particles() {
  PetscFunctionBegin;
  if (!model->mechanics()) PetscCall(fail(comm, Exit::input, std::string("a ") + model->name() + " system has no particles"));
  PetscFunctionReturn(0);
}

/// The option of a file that the run writes; empty: it writes none.
std::string Session::Impl::file_of_run() {
  for (const char* const file : {"-bs_output", "-bs_report", "-bs_checkpoint"})
    if (is_given(file)) return file;
  return {};
}

PetscErrorCode Session::Impl::refuse_files() {
  PetscFunctionBegin;
  if (const std::string file = file_of_run(); !file.empty())
    PetscCall(fail(comm, Exit::input, "option " + file + ": the file of a run has no place for a state that is set: leave it out"));
  PetscFunctionReturn(0);
}

/// The vector is the model's, the same for all runs.
PetscErrorCode Session::Impl::view(Array what, View* out) {
  Vec y;
  PetscFunctionBegin;
  PetscCall(begin());
  PetscCall(require_particles());
  if (what == Array::force || what == Array::reaction) PetscCall(fail(comm, Exit::input, "forces are no part of the state: ask for a copy of them"));
  const std::string why = model->mechanics()->why_not_by_rows();
  if (!why.empty()) PetscCall(fail(comm, Exit::input, "no view of the state, but copies: " + why));
  PetscCall(run->state_vector(&y));
  const Layout& at = model->mechanics()->layout();
  PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(y)));
  out->memory = std::shared_ptr<const void>(y, [](const void* vec) {
    Vec seen = static_cast<Vec>(const_cast<void*>(vec));
    PetscBool running = PETSC_FALSE;
    (void)PetscInitialized(&running);
    if (running) (void)VecDestroy(&seen);
  });
  out->first = ReadArray(y).data() + (what == Array::position ? at.x(0) : at.v(0));
  out->rows = at.particles;
  out->stride = at.block();
  viewed = true;
  PetscFunctionReturn(0);
}

/// Views show what the next run begins with.
PetscErrorCode Session::Impl::show_given() {
  PetscFunctionBegin;
  if (viewed) PetscCall(VecCopy(given_state, model->initial_state()));
  PetscFunctionReturn(0);
}

static void copy_to(Vec v, const std::vector<double>& numbers) { std::copy(numbers.begin(), numbers.end(), WriteArray(v).data()); }

/// Numbers of this rank's rows.
PetscErrorCode Session::Impl::check_rows(const std::vector<double>& rows) {
  Error error;
  const std::int64_t d = std::max(1, model->dim());
  PetscFunctionBegin;
  if (rows.size() != static_cast<std::size_t>(particles.count * d))
    error.note(particles.first,
               format("%zu numbers for %lld particles in %d dimensions", rows.size(), static_cast<long long>(particles.count), model->dim()));
  const auto bad = std::find_if_not(rows.begin(), rows.end(), [](double number) { return std::isfinite(number); });
  const std::int64_t row = particles.first + (bad - rows.begin()) / d;
  if (bad != rows.end()) error.note(row, format("row %lld is not finite: give numbers", static_cast<long long>(row)));
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
  PetscCall(show_given());
  PetscFunctionReturn(0);
}

/// The present run ends; the next one begins at `time`, with given_state, and with a method without history unless `resumed` brings one.
PetscErrorCode Session::Impl::start_anew(double time, std::int64_t steps) {
  PetscFunctionBegin;
  start = time;
  earlier_steps = steps;
  resumed.reset();
  PetscCall(PetscOptionsSetValue(nullptr, "-ts_init_time", format("%.17g", start).c_str()));
  PetscCall(PetscOptionsClearValue(nullptr, "-bs_restart"));
  run.reset();
  failed = false;
  locks.reset();
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::drive(const std::string& group, double t, const std::vector<double>& rows) {
  Vec y;
  VecHandle places;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(leave_failed_run());
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

/// The parts of y with what is held where it is at time t.
PetscErrorCode Session::Impl::show_held(double t, Vec y, SavedState::Parts* out) {
  VecHandle shown;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(copy_into(&shown, y));
  PetscCall(model->mechanics()->place_held(t, shown));
  PetscCall(model->gather_state(shown, &parts));
  PetscCall(read_parts(comm, parts, false, out));
  PetscFunctionReturn(0);
}

/// Groups whose motion is given, all where no name is, move from where they are at time `from` to where `there` has them at `to`.
PetscErrorCode Session::Impl::lead(const std::string& group, double from, double to, const SavedState::Parts& there) {
  VecHandle y;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(model->initial_state(), y.out()));
  PetscCall(model->gather_state(model->initial_state(), &parts));  // for their vectors
  PetscCall(put_parts(comm, there, false, parts));
  PetscCall(model->scatter_state(y));
  PetscCall(model->mechanics()->give_motion(group, from, to, y));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::save(State* out) {
  Vec y;
  PetscFunctionBegin;
  PetscCall(leave_failed_run());
  PetscCall(begin());
  PetscCall(run->state_vector(&y));
  out->steps = steps_so_far();
  out->number = ++saved;
  out->made_of = made_of;
  out->changed = changed;
  out->removed = removed;
  PetscCall(read_state(*model, run->time(), y, false, out));
  const auto kept = std::make_shared<KeptCheckpoint>();
  PetscCall(run->keep(kept.get()));
  out->run = kept;
  if (!model->mechanics()) PetscFunctionReturn(0);
  PetscCall(show_held(out->time, y, &out->shown));
  for (const Mechanics::GivenMotion& one : model->mechanics()->given_motions()) {
    out->ways.push_back({one.group, one.from, one.to, {}, {}});
    PetscCall(show_held(one.from, y, &out->ways.back().there_from));
    PetscCall(show_held(one.to, y, &out->ways.back().there_to));
  }
  PetscFunctionReturn(0);
}

/// Whether it is one of this system on these ranks, and the same one on all.
PetscErrorCode Session::Impl::check_state(const State& state) {
  Error error;
  bool fitting = false;
  std::int64_t most[2] = {state.number, -state.number};
  PetscFunctionBegin;
  PetscCall(fits(*model, state, &fitting));
  fitting = fitting && state.made_of == made_of && state.shown.empty() == (model->mechanics() == nullptr);
  PetscCall(max_over_ranks(comm, most, 2));
  if (!fitting)
    error.note(0, "the state is of another lattice, of other laws or of another number of ranks: give one that was saved of the same lattice");
  else if (most[0] != -most[1])
    error.note(0, "the states that the ranks give are not of one moment: give on every rank what one save() has returned");
  PetscCall(fail_if_any(comm, error));
  PetscFunctionReturn(0);
}

/// What is broken is brought back before numbers are, which whole springs alone are given.
PetscErrorCode Session::Impl::restore(const State& state) {
  PetscFunctionBegin;
  PetscCall(open());
  PetscCall(refuse_files());
  PetscCall(check_state(state));
  for (const auto& [name, numbers] : numbers_of(state)) PetscCall(make_room(name, *numbers));
  PetscCall(VecDuplicate(model->initial_state(), given_state.out()));
  PetscCall(start_anew(state.time, state.steps));
  PetscCall(put_state(*model, state, given_state));
  PetscCall(show_given());
  PetscCall(restore_numbers(state));
  model->restore_sums(state.sums);  // the numbers have changed what is counted as dissipated
  resumed = state.run;
  if (state.shown.empty()) PetscFunctionReturn(0);
  PetscCall(lead("", state.time, state.time, state.shown));
  for (const Mechanics::GivenMotion& here : model->mechanics()->given_motions())
    for (const State::Way& way : state.ways)
      if (way.group == here.group) {
        PetscCall(lead(way.group, way.from, way.from, way.there_from));
        PetscCall(lead(way.group, way.from, way.to, way.there_to));
      }
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::inherit(const SavedState& equilibrium) {
  PetscFunctionBegin;
  if (run || given_state) PetscCall(fail(comm, Exit::input, "an equilibrium is inherited before the first step alone"));
  held_by<Client>(comm).gives_histories = true;
  PetscCall(open());
  PetscCall(put_memory(*model, equilibrium));
  std::map<std::string, double> sums = equilibrium.sums;
  for (const auto& [name, sum] : equilibrium.sums)
    if (name.rfind("breaking/", 0) != 0 || name == "breaking/motion" || name == "breaking/motion_steps" || name == "breaking/last" ||
        name == "breaking/running")
      sums.erase(name);
  model->restore_sums(sums);
  PetscFunctionReturn(0);
}

}  // namespace bs
