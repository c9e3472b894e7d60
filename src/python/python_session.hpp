// A session with what Python asks for between its steps and computes in them.
#pragma once
#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <algorithm>
#include <csignal>
#include <exception>
#include <memory>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>
#include "base/collective.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"
#include "session/session.hpp"

namespace bs::python {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A session with what Python asks for between its steps and computes in them. An exception of Python's there, KeyboardInterrupt among them, ends the
/// call on all ranks and is raised anew when it has ended.
class PythonSession {
 public:
  /// lattice: taken over, and empty afterwards. forces: None, or functions (force, tangent, energy), of which the last two may be None, pairs (P, 2)
  /// of particles between which they act, a function that is told of the beginnings of steps, or None, and one that limits steps, or None.
  PythonSession(std::int64_t comm, LatticeArrays& lattice, const Settings& settings, const py::object& forces) {
    if (!forces.is_none())
      std::tie(force_, tangent_, energy_, between_, begin_step_, limit_) =
          forces.cast<std::tuple<py::object, py::object, py::object, ForceCallback::Pairs, py::object, py::object>>();
    const Turn turn;
    MPI_Comm mpi = MPI_Comm_f2c(static_cast<MPI_Fint>(comm));
    MPI_Comm_dup(mpi, &comm_);
    const PetscMPIInt ranks = size_of(comm_);
    several_ = ranks > 1;
    error_ = Session::create(mpi, std::move(lattice), settings, &session_, Session::Make::when_needed);
    if (!session_) return;
    session_->on_poll([this] { return poll(); });
    if (!force_.is_none()) session_->on_force(own_forces());
  }
  py::object error() const { return as_python(error_); }
  Session* operator->() const {
    if (!session_) throw std::runtime_error("the simulation is closed: make another one");
    return session_.get();
  }
  /// `body()` of the session. Where Python has raised an exception on some rank, all ranks leave with one. `asks`: it only looks at the state, which
  /// an observer may do.
  template <class Body>
  Error call(Body&& body, bool asks = false) {
    Error error;
    bool outermost = true;
    {
      const Turn turn;
      (void)operator->();
      if (several_ && std::this_thread::get_id() != thread_)
        throw std::runtime_error(
            "on several ranks a simulation is one thread's, the one that made it: threads may take turns differently on each rank");
      if (in_force_ || (busy_ && !asks))
        throw std::runtime_error("a call of this simulation is under way: an observer may look at its state, forces may not");
      outermost = !busy_;
      busy_ = true;
      error = body();
      busy_ = !outermost;
    }
    if (!outermost) return error;
    bool raised = false;
    (void)on_some_rank(comm_, raised_ != nullptr, &raised);
    if (raised_) std::rethrow_exception(std::exchange(raised_, nullptr));
    if (raised) {
      error = {};
      error.note(0, "another rank was interrupted, or raised an exception in an observer or in forces", static_cast<Exit>(128 + SIGINT));
    }
    return error;
  }
  /// Collective, between the session's calls, by a communicator that nobody else uses. Whether it is so on some rank.
  bool on_some(bool yes) const {
    const Turn turn;
    (void)operator->();
    (void)on_some_rank(comm_, yes, &yes);
    return yes;
  }
  void observe(const py::object& observer) {
    (void)operator->();
    observer_ = observer;
    if (observer.is_none()) return session_->on_step({});
    session_->on_step([this](const StepRecord& r) {
      const py::gil_scoped_acquire lock;
      guarded([&] {
        const py::object called = observer_;  // which it may replace
        if (called(r.step, r.time, r.dt, r.newton, r.krylov, r.rejected).is(py::bool_(true))) session_->pause();
      });
    });
  }
  /// For Python's collector of garbage: what of Python's it holds, and no longer.
  int traverse(visitproc visit, void* arg) const {
    for (const py::object* one : {&force_, &tangent_, &energy_, &begin_step_, &limit_, &observer_}) Py_VISIT(one->ptr());
    return 0;
  }
  void let_go() {
    for (py::object* one : {&force_, &tangent_, &energy_, &begin_step_, &limit_, &observer_}) *one = py::none();
  }
  PythonSession(const PythonSession&) = delete;
  PythonSession& operator=(const PythonSession&) = delete;
  ~PythonSession() {
    PetscBool running = PETSC_FALSE;
    (void)PetscInitialized(&running);
    if (running) {
      close(true);
      if (comm_ != MPI_COMM_NULL) MPI_Comm_free(&comm_);
    } else {
      (void)session_.release();  // the interpreter ends, and PETSc has ended
    }
  }
  /// `anyway`: whoever waits for this thread.
  void close(bool anyway = false) {
    {
      const Turn turn(anyway);
      if (!session_) return;
      if (busy_) throw std::runtime_error("a call of this simulation is under way: close it afterwards");
      session_->on_step({});
      (void)session_->finish();  // while the session can still be asked, as forces do
      session_.reset();
    }
    let_go();
  }

 private:
  template <class Body>
  void guarded(Body&& body) {
    if (raised_) return;
    try {
      body();
    } catch (...) {
      raised_ = std::current_exception();
    }
  }
  using RowList = ForceCallback::Rows;
  /// What a function of Python returns of some particles, a list of arrays, into `out`: each with how many numbers it has. Not numbers where it
  /// raised an exception.
  void ask(const py::object& function, double t, const RowList& row, const ForceCallback::Pairs& pair, const double* x, const double* v,
           const std::vector<std::pair<double*, py::ssize_t>>& out) {
    const py::gil_scoped_acquire lock;
    const py::ssize_t n = static_cast<py::ssize_t>(row.size()), d = session_->dim();
    for (const auto& [to, size] : out) std::fill_n(to, size, std::nan(""));
    in_force_ = true;
    guarded([&] {
      const py::array_t<double> places({n, d}, x);
      const py::object speeds = v ? py::object(py::array_t<double>({n, d}, v)) : py::none();
      const py::array_t<std::int64_t> rows(n, row.data()),
          pairs({static_cast<py::ssize_t>(pair.size()), py::ssize_t(2)}, pair.empty() ? nullptr : pair[0].data());
      const py::list found = function(t, places, speeds, rows, pairs);
      for (std::size_t k = 0; k < out.size(); ++k) {
        const Numbers numbers = found[k].cast<Numbers>();
        if (numbers.size() != out[k].second) throw py::value_error("forces: arrays of another size than that of the particles asked for");
        std::copy_n(numbers.data(), numbers.size(), out[k].first);
      }
    });
    in_force_ = false;
  }
  void tell_begin(double t, double h, std::int64_t number, std::int64_t attempt, const RowList& row, const double* x, const double* v) {
    const py::gil_scoped_acquire lock;
    const py::ssize_t n = static_cast<py::ssize_t>(row.size()), d = session_->dim();
    in_force_ = true;
    guarded([&] {
      (void)begin_step_(t, h, number, attempt, py::array_t<double>({n, d}, x), py::array_t<double>({n, d}, v),
                        py::array_t<std::int64_t>(n, row.data()));
    });
    in_force_ = false;
  }
  ForceCallback own_forces() {
    using Rows = RowList;
    ForceCallback all;
    const auto d = [this] { return static_cast<py::ssize_t>(session_->dim()); };
    const auto size = [](const auto& list) { return static_cast<py::ssize_t>(list.size()); };
    all.between = between_;
    all.force = [=](double t, const Rows& row, const double* x, const double* v, double* f) {
      ask(force_, t, row, {}, x, v, {{f, size(row) * d()}});
    };
    if (!tangent_.is_none())
      all.tangent = [=](double t, const Rows& row, const ForceCallback::Pairs& pair, const double* x, const double* v,
                        const ForceCallback::Blocks& add) {
        const py::ssize_t own = size(row) * d() * d(), between = size(pair) * d() * d();
        ask(tangent_, t, row, pair, x, v, {{add.K, own}, {add.D, own}, {add.K_between, between}, {add.D_between, between}});
      };
    if (!energy_.is_none())
      all.energy = [=](double t, const Rows& row, const double* x, double* E) { ask(energy_, t, row, {}, x, nullptr, {{E, size(row)}}); };
    if (!begin_step_.is_none())
      all.begin_step = [=](double t, double h, std::int64_t number, std::int64_t attempt, const Rows& row, const double* x, const double* v) {
        tell_begin(t, h, number, attempt, row, x, v);
      };
    if (!limit_.is_none())
      all.limit = [=](double t, const Rows& row, const double* x, const double* dx) {
        double lambda = 0;
        ask(limit_, t, row, {}, x, dx, {{&lambda, 1}});
        return lambda;
      };
    return all;
  }
  int poll() {
    const py::gil_scoped_acquire lock;
    guarded([] {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    });
    return raised_ ? SIGINT : 0;
  }

  std::unique_ptr<Session> session_;
  MPI_Comm comm_ = MPI_COMM_NULL;  ///< for what this class agrees on
  bool busy_ = false, in_force_ = false, several_ = false;
  const std::thread::id thread_ = std::this_thread::get_id();
  Error error_;
  std::exception_ptr raised_;
  ForceCallback::Pairs between_;
  py::object force_ = py::none(), tangent_ = py::none(), energy_ = py::none(), begin_step_ = py::none(), limit_ = py::none(), observer_ = py::none();
};

}  // namespace bs::python
