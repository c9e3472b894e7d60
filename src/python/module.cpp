// The Python module backspring._core: what Session offers, with NumPy's arrays. Checks of arguments, defaults and names are the package's, in Python.
#include "python/module.hpp"
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include "base/option_aliases.hpp"
#include "session/session.hpp"
#include "time/disown.hpp"

namespace bs::python {

namespace py = pybind11;

static std::recursive_timed_mutex in_use;
static std::atomic<unsigned long> holder{0};  // the thread whose turn it is; 0: nobody's
static int turns = 0;                         // of that thread, within one another

Turn::Turn(bool anyway) {
  constexpr std::chrono::milliseconds PATIENCE(200);
  alone_ = std::unique_lock<std::recursive_timed_mutex>(in_use, std::defer_lock);
  while (!alone_.try_lock_for(PATIENCE)) {
    const py::gil_scoped_acquire lock;
    if (!anyway && py::module_::import("backspring.threads").attr("waits_for_this")(holder.load()).cast<bool>())
      throw std::runtime_error(
          "another thread is in a call of backspring and waits there, in an observer or in forces, for this one, which would wait for that call for "
          "ever: call backspring in the observer itself, or wait for this thread after the call");
  }
  holder = PyThread_get_thread_ident();
  ++turns;
}

Turn::~Turn() {
  if (--turns == 0) holder = 0;
}

/// MPI and PETSc run from the first use to finish().
static std::unique_ptr<Library>& library() {
  static std::unique_ptr<Library> running;
  return running;
}

/// As an exception of Python's, which petsc4py leaves as it is where the code is that of PETSC_ERR_PYTHON.
static PetscErrorCode raise(const char* text) {
  const py::gil_scoped_acquire lock;
  PyErr_SetString(PyExc_RuntimeError, text);
  return static_cast<PetscErrorCode>(-1);
}

static bool start() {
  PetscBool before = PETSC_FALSE;
  if (library()) return library()->started();
  (void)PetscInitialized(&before);
  library() = std::make_unique<Library>();
  tell_of_refusals(raise);
  // errors of calls by petsc4py are codes, which it raises: PETSc's own handler would abort all ranks
  if (!before && library()->started()) (void)PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
  return library()->started();
}

py::object as_python(const Error& error) {
  if (!error) return py::none();
  return py::make_tuple(static_cast<int>(error.exit), error.text);
}

PYBIND11_MODULE(_core, m) {
  m.def("start", start);
  m.def("finish", [] { library().reset(); });
  m.def("kept_name", kept_name);
  bind_lattices(m);
  bind_sessions(m);
}

}  // namespace bs::python
