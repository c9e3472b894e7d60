#include "session/session.hpp"
#include <algorithm>
#include <iterator>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/option_names.hpp"
#include "session/session_impl.hpp"
#include "systems/client.hpp"
#include "tasks/modes.hpp"
#include "tasks/statics/statics.hpp"

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

Session::Session(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Session::~Session() { (void)finish(); }

/// `body()` with the session's options in force; what went wrong.
template <class Body>
Error Session::call(Body&& body) {
  const Inside inside(impl_->comm, impl_->options);
  return outcome(impl_->comm, body());
}

Error Session::create(MPI_Comm comm, std::unique_ptr<Lattice> given, const Settings& settings, Make make, std::unique_ptr<Session>* out) {
  auto impl = std::make_unique<Impl>();
  Impl* const own = impl.get();
  own->comm = own_communicator(comm, [own](const std::string& text) { own->warnings.push_back(text); });
  own->settings = settings;
  held_by<Client>(own->comm).moves_groups = true;
  own->given = std::move(given);
  std::unique_ptr<Session> session(new Session(std::move(impl)));
  Error error = filled(own->comm, settings, {}, &own->options);
  if (own->given) own->dim = own->given->dim;
  if (!error && make == Make::at_once) error = session->prepare();
  if (!error) *out = std::move(session);
  return error;
}

Error Session::create(MPI_Comm comm, LatticeArrays lattice, const Settings& settings, std::unique_ptr<Session>* out, Make make) {
  auto whole = std::make_unique<Lattice>();
  Error error;
  if (!lattice_of(std::move(lattice), whole.get(), &error.text)) return error;
  return create(comm, std::move(whole), settings, make, out);
}

Error Session::create(MPI_Comm comm, const Settings& settings, std::unique_ptr<Session>* out, Make make) {
  return create(comm, nullptr, settings, make, out);
}

Error Session::prepare() {
  return call([&] { return impl_->open(); });
}

Error Session::step(std::int64_t count) {
  return call([&] { return impl_->step(count); });
}

Error Session::run_until(double t) {
  return call([&] { return impl_->run_until(t); });
}

Error Session::run_to_frame(bool* more) {
  return call([&] { return impl_->run_to_frame(more); });
}

Error Session::finish() {
  return call([&] { return impl_->finish(); });
}

/// An analysis with the options that say what the system is and those of `more`; what the last one has left is gone.
template <class Body>
Error Session::analyse(const Settings& more, Result* out, Body&& body) {
  int exit_code = 0;
  *out = {};
  impl_->drop_statics();
  impl_->analysis_options = std::make_unique<OptionTable>();
  const Error error = filled(impl_->comm, of_the_system(impl_->settings), more, impl_->analysis_options.get());
  if (error) return error;
  const Inside inside(impl_->comm, *impl_->analysis_options);
  PetscErrorCode code = impl_->take_up_settings();
  if (!code) code = body(&exit_code);
  if (!code) code = impl_->stopped(exit_code);
  return outcome(impl_->comm, code);
}

Error Session::solve_statics(Result* out, const Settings& more) {
  return analyse(more, out, [&](int* exit_code) { return impl_->solve_statics(Analyses::compliance, out, exit_code); });
}

Error Session::moduli(Result* out, const Settings& more) {
  return analyse(more, out, [&](int* exit_code) { return impl_->solve_statics(Analyses::moduli, out, exit_code); });
}

Error Session::follow(Result* out) {
  const Inside inside(impl_->comm, impl_->statics ? *impl_->analysis_options : impl_->options);
  return outcome(impl_->comm, impl_->follow(out));
}

Error Session::sensitivities(const std::vector<double>& slope, std::map<std::string, std::vector<double>>* out) {
  const Inside inside(impl_->comm, impl_->statics ? *impl_->analysis_options : impl_->options);
  return outcome(impl_->comm, impl_->sensitivities(slope, out));
}

void Session::expect_changes() { held_by<Client>(impl_->comm).changes_numbers = true; }

Error Session::set_numbers(const std::string& name, const std::vector<double>& all) {
  return call([&] { return impl_->set_numbers(name, all); });
}

Error Session::remove_springs(const std::vector<std::int64_t>& rows) {
  return call([&] { return impl_->remove_springs(rows); });
}

Error Session::modes(std::optional<std::int64_t> count, Result* out, const Settings& more, const SavedState* about) {
  Settings all = more;
  if (count) all.emplace_back("-bs_modes", std::to_string(*count));
  return analyse(all, out, [&](int* exit_code) { return impl_->modes(out, about, exit_code); });
}

double Session::time() const { return impl_->run ? impl_->run->time() : impl_->start; }

std::int64_t Session::steps() const { return impl_->steps_so_far(); }

Rows Session::particles() const { return impl_->particles; }

int Session::dim() const { return impl_->dim; }

Error Session::get_rows(Array what, std::vector<double>* rows) {
  return call([&] { return impl_->get(what, rows); });
}

Error Session::get(Array what, std::vector<double>* all) {
  std::vector<double> rows;
  return call([&] {
    const PetscErrorCode code = impl_->get(what, &rows);
    return code ? code : gather_all(impl_->comm, std::move(rows), all);
  });
}

Error Session::view(Array what, View* out) {
  return call([&] { return impl_->view(what, out); });
}

Error Session::set_rows(Array what, const std::vector<double>& rows) {
  return call([&] { return impl_->set(what, rows); });
}

Error Session::drive(const std::string& group, double t, const std::vector<double>& rows) {
  return call([&] { return impl_->drive(group, t, rows); });
}

Error Session::save(std::shared_ptr<const State>* out) {
  auto state = std::make_shared<State>();
  Error error = call([&] { return impl_->save(state.get()); });
  if (!error) *out = std::move(state);
  return error;
}

Error Session::restore(const State& state) {
  return call([&] { return impl_->restore(state); });
}

Error Session::inherit(const SavedState& equilibrium) {
  return call([&] { return impl_->inherit(equilibrium); });
}

Error Session::stepper(TS* ts) {
  return call([&]() -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(impl_->begin());
    *ts = impl_->run->stepper();
    PetscFunctionReturn(0);
  });
}

Error Session::load_stepper(TS* ts) {
  return call([&]() -> PetscErrorCode {
    PetscFunctionBegin;
    if (!impl_->statics) PetscCall(fail(impl_->comm, Exit::input, "there is no equilibrium whose solver could be looked at: solve for one first"));
    *ts = impl_->statics->stepper();
    PetscFunctionReturn(0);
  });
}

Error Session::get_frame(FrameData* out) {
  if (!impl_->loading) return call([&] { return impl_->get_frame(out); });
  const Inside inside(impl_->comm, *impl_->analysis_options);
  return outcome(impl_->comm, impl_->statics->frame(out));
}

void Session::on_poll(std::function<int()> poll) {
  Signals signals;
  signals.ending = std::move(poll);
  set_signals(impl_->comm, signals);
}

void Session::on_force(ForceCallback forces) { held_by<ForceCallback>(impl_->comm) = std::move(forces); }

void Session::on_step(std::function<void(const StepRecord&)> observer) {
  held_by<LoadStepObserver>(impl_->comm).on_step = observer;
  impl_->step_observer = std::move(observer);
}

void Session::pause() {
  impl_->paused = true;
  if (impl_->loading) (void)impl_->statics->pause();
  else if (impl_->run) (void)impl_->run->pause();
}

Error Session::checkpoint(const std::string& file) {
  return call([&] { return impl_->checkpoint(file); });
}

void Session::on_frame(std::function<void(double)> observer) { impl_->frame_observer = std::move(observer); }

const std::vector<std::string>& Session::warnings() const { return impl_->warnings; }

MPI_Comm Session::comm() const { return impl_->comm; }

Library::Library() {
  int running = 0;
  PetscBool there = PETSC_FALSE;
  MPI_Initialized(&running);
  if (!running) {
    int provided = 0;
    mpi_ = MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided) == MPI_SUCCESS;
  }
  there_ = PetscInitialized(&there) == 0 && there;
  if (there_ || !(running || mpi_)) return;
  static char name[] = "backspring", no_signals[] = "-no_signal_handler";
  petsc_ = there_ = start_petsc({name, no_signals}, nullptr) == 0;
}

Library::~Library() {
  if (petsc_) (void)end_petsc();
  if (mpi_) MPI_Finalize();
}

}  // namespace bs
