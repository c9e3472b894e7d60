#include "session/session.hpp"
#include <petscts.h>
#include <algorithm>
#include <iterator>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/handle.hpp"
#include "base/option_names.hpp"
#include "checkpoint/checkpoint.hpp"
#include "session/inside.hpp"
#include "systems/create.hpp"
#include "systems/frame_rows.hpp"
#include "systems/mechanics.hpp"
#include "tasks/modes.hpp"
#include "tasks/run.hpp"
#include "tasks/statics/box_stress.hpp"
#include "tasks/statics/statics.hpp"
#include "tasks/tasks.hpp"

namespace bs {

namespace {

/// Those that say what the system is, and not how it is stepped or which files are written.
Settings of_the_system(const Settings& settings) {
  static const char* const others[] = {"-bs_output", "-bs_report",  "-bs_checkpoint", "-bs_restart",   "-bs_overwrite", "-bs_write_", "-bs_step_",
                                       "-bs_stop_",  "-bs_energy_", "-bs_advise",     "-bs_progress_", "-bs_atol_",     "-bs_rtol_"};
  Settings kept;
  for (const auto& one : settings) {
    const std::string name = lower(one.first);
    const auto begins = [&](const char* word) { return name.rfind(word, 0) == 0; };
    if (begins("-bs_") && std::none_of(std::begin(others), std::end(others), begins)) kept.push_back(one);
  }
  return kept;
}

}  // namespace

struct Session::Impl {
  MPI_Comm comm = MPI_COMM_NULL;  ///< a duplicate of the caller's, with errors and all else that is remembered
  Settings settings;
  std::unique_ptr<Lattice> given;  ///< the whole; null: the settings name one
  OptionTable options;
  std::vector<std::string> warnings;
  std::function<void(const StepRecord&)> step_observer;
  std::function<void(double)> frame_observer;
  Rows particles;

  std::unique_ptr<Model> model;
  std::unique_ptr<OutputLocks> locks;  ///< of the files that are written
  std::unique_ptr<Run> run;            ///< null: nothing was stepped
  double start = 0;                    ///< before that [s]
  bool finished = false;

  PetscErrorCode open();
  PetscErrorCode make_model(std::unique_ptr<Model>* out);
  PetscErrorCode count_particles();
  PetscErrorCode begin();
  PetscErrorCode advance(std::int64_t count);
  PetscErrorCode step(std::int64_t count);
  PetscErrorCode run_until(double t);
  PetscErrorCode finish();
  PetscErrorCode get(Array what, std::vector<double>* rows);
  PetscErrorCode forces(double t, Vec y, std::vector<double>* rows);
  PetscErrorCode analyse(TaskFunction task, Result* out);
  ~Impl();
};

Session::Impl::~Impl() {
  {
    const Inside inside(comm, options);
    run.reset();
    model.reset();
  }
  if (comm != MPI_COMM_NULL) MPI_Comm_free(&comm);
}

PetscErrorCode Session::Impl::open() {
  PetscFunctionBegin;
  PetscCall(register_types());
  PetscCall(recall_options(comm));
  PetscCall(make_model(&model));
  PetscCall(count_particles());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-ts_init_time", &start, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::make_model(std::unique_ptr<Model>* out) {
  PetscFunctionBegin;
  PetscCall(read_mode_options(comm));
  PetscCall(create_model(comm, out, given.get()));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::count_particles() {
  std::vector<StatePart> parts;
  PetscInt first = 0, end = 0, size = 0, width = 1;
  PetscFunctionBegin;
  if (!model->mechanics()) PetscFunctionReturn(0);
  PetscCall(model->gather_state(model->initial_state(), &parts));
  PetscCall(VecGetBlockSize(parts[0].vec, &width));
  PetscCall(VecGetSize(parts[0].vec, &size));
  PetscCall(VecGetOwnershipRange(parts[0].vec, &first, &end));
  particles = {first / width, (end - first) / width, size / width};
  PetscFunctionReturn(0);
}

/// Up to the first step: the run of the program, with the session's observers.
PetscErrorCode Session::Impl::begin() {
  RunOptions run_options;
  RunHooks hooks;
  PetscFunctionBegin;
  if (finished) PetscCall(fail(comm, Exit::input, "the session is finished: create another one"));
  if (run) PetscFunctionReturn(0);
  PetscCall(refuse_box_stress(*model, "a session that steps in time"));
  PetscCall(read_run_options(comm, Steps::time, &run_options));
  run_options.keep_input = true;
  locks = std::make_unique<OutputLocks>();
  PetscCall(lock_outputs(comm, run_options, locks.get()));
  hooks.on_step = [this](const StepRecord& record) {
    if (step_observer) step_observer(record);
  };
  hooks.on_frame = [this](double time) {
    if (frame_observer) frame_observer(time);
  };
  hooks.pace.end += start;  // where the settings name no end there is none
  auto fresh = std::make_unique<Run>(*model, run_options, hooks);
  PetscCall(fresh->set_up());
  if (!is_given("-ts_max_time")) PetscCall(fresh->leave_open());
  run = std::move(fresh);
  PetscCall(run->begin());
  PetscFunctionReturn(0);
}

/// Up to the end, or so many steps.
PetscErrorCode Session::Impl::advance(std::int64_t count) {
  const std::int64_t before = run->steps();
  std::string why;
  PetscFunctionBegin;
  PetscCall(run->go_on(count));
  PetscCall(run->trouble(&why));
  if (why.empty() && run->steps() == before) why = "no step was taken: -ts_max_steps allows no more";
  if (!why.empty()) PetscCall(fail(comm, Exit::solve, why));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::step(std::int64_t count) {
  PetscFunctionBegin;
  PetscCall(begin());
  for (const std::int64_t last = run->steps() + count; run->steps() < last;) {
    if (run->at_end()) PetscCall(run->leave_open());
    PetscCall(advance(last - run->steps()));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::run_until(double t) {
  PetscFunctionBegin;
  PetscCall(begin());
  if (!(t > run->time())) PetscFunctionReturn(0);
  PetscCall(run->set_end(t));
  while (!run->at_end()) PetscCall(advance(-1));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::finish() {
  int exit_code = 0;
  PetscFunctionBegin;
  if (finished || !run) PetscFunctionReturn(0);
  finished = true;
  PetscCall(run->end(&exit_code));
  locks.reset();
  PetscFunctionReturn(0);
}

/// Laid into the places of a state, from which they travel to the input's order.
PetscErrorCode Session::Impl::forces(double t, Vec y, std::vector<double>* rows) {
  const double* f = nullptr;
  VecHandle places;
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(model->mechanics()->force(t, y, &f));
  PetscCall(VecDuplicate(y, places.out()));
  PetscCall(VecZeroEntries(places));
  set_part(places, Part::position, f);
  PetscCall(model->gather_state(places, &parts));
  PetscCall(own_numbers(parts[0].vec, rows));
  PetscFunctionReturn(0);
}

PetscErrorCode Session::Impl::get(Array what, std::vector<double>* rows) {
  Vec y;
  PetscFunctionBegin;
  if (!model->mechanics()) PetscCall(fail(comm, Exit::input, std::string("a ") + model->name() + " system has no particles"));
  PetscCall(begin());
  PetscCall(run->state_vector(&y));
  if (what == Array::force) PetscCall(forces(run->time(), y, rows));
  else PetscCall(frame_rows(*model, run->time(), y, what == Array::position ? "/position" : "/velocity", rows));
  PetscFunctionReturn(0);
}

/// A task on a model of its own, with its own table of options.
PetscErrorCode Session::Impl::analyse(TaskFunction task, Result* out) {
  int exit_code = 0;
  std::unique_ptr<Model> fresh;
  PetscFunctionBegin;
  *out = {};
  PetscCall(make_model(&fresh));
  PetscCall(task(std::move(fresh), out, &exit_code));
  PetscFunctionReturn(0);
}

Session::Session(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Session::~Session() { (void)finish(); }

/// `body()` with the session's options in force; what went wrong.
template <class Body>
Error Session::call(Body&& body) {
  const Inside inside(impl_->comm, impl_->options);
  return outcome(impl_->comm, body());
}

Error Session::create(MPI_Comm comm, std::unique_ptr<Lattice> given, const Settings& settings, std::unique_ptr<Session>* out) {
  auto impl = std::make_unique<Impl>();
  Impl* const own = impl.get();
  MPI_Comm_dup(comm, &own->comm);
  drop_context(own->comm);  // that of the caller's communicator
  Listener listener;
  listener.warning = [own](const std::string& text) { own->warnings.push_back(text); };
  set_listener(own->comm, listener);
  own->settings = settings;
  own->given = std::move(given);
  std::unique_ptr<Session> session(new Session(std::move(impl)));
  Error error = filled(own->comm, settings, {}, &own->options);
  if (!error) error = session->call([own] { return own->open(); });
  if (!error) *out = std::move(session);
  return error;
}

Error Session::create(MPI_Comm comm, const LatticeArrays& lattice, const Settings& settings, std::unique_ptr<Session>* out) {
  auto whole = std::make_unique<Lattice>();
  Error error;
  if (!lattice_of(lattice, whole.get(), &error.text)) return error;
  return create(comm, std::move(whole), settings, out);
}

Error Session::create(MPI_Comm comm, const Settings& settings, std::unique_ptr<Session>* out) { return create(comm, nullptr, settings, out); }

Error Session::step(std::int64_t count) {
  return call([&] { return impl_->step(count); });
}

Error Session::run_until(double t) {
  return call([&] { return impl_->run_until(t); });
}

Error Session::finish() {
  return call([&] { return impl_->finish(); });
}

Error Session::analyse(TaskFunction task, const Settings& more, Result* out) {
  OptionTable options;
  const Error error = filled(impl_->comm, of_the_system(impl_->settings), more, &options);
  if (error) return error;
  const Inside inside(impl_->comm, options);
  return outcome(impl_->comm, impl_->analyse(task, out));
}

Error Session::solve_statics(Result* out, const Settings& more) { return analyse(run_statics, more, out); }

Error Session::moduli(Result* out, const Settings& more) { return analyse(run_moduli, more, out); }

Error Session::modes(std::int64_t count, Result* out, const Settings& more) {
  Settings all = more;
  all.emplace_back("-bs_modes", std::to_string(count));
  return analyse(run_modes, all, out);
}

double Session::time() const { return impl_->run ? impl_->run->time() : impl_->start; }

std::int64_t Session::steps() const { return impl_->run ? impl_->run->steps() : 0; }

Rows Session::particles() const { return impl_->particles; }

int Session::dim() const { return impl_->model->dim(); }

Error Session::get_rows(Array what, std::vector<double>* rows) {
  return call([&] { return impl_->get(what, rows); });
}

Error Session::get(Array what, std::vector<double>* all) {
  std::vector<double> rows;
  return call([&] {
    const PetscErrorCode code = impl_->get(what, &rows);
    return code ? code : gather_all(impl_->comm, rows, all);
  });
}

void Session::on_step(std::function<void(const StepRecord&)> observer) { impl_->step_observer = std::move(observer); }

void Session::on_frame(std::function<void(double)> observer) { impl_->frame_observer = std::move(observer); }

const std::vector<std::string>& Session::warnings() const { return impl_->warnings; }

MPI_Comm Session::comm() const { return impl_->comm; }

}  // namespace bs
