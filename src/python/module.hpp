// The parts of the Python module.
#pragma once
#include <pybind11/pybind11.h>
#include <mutex>
#include "base/error.hpp"

namespace bs::python {

void bind_lattices(pybind11::module_& m);
void bind_sessions(pybind11::module_& m);

/// While it lives, this thread alone is in the library, which is one thread's at a time, and Python's lock is free. Callbacks may take turns within
/// it. Throws where the thread whose turn it is waits for this one, in a callback, unless it has to wait `anyway`.
class Turn {
 public:
  explicit Turn(bool anyway = false);
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  ~Turn();

 private:
  pybind11::gil_scoped_release free_;  // before it waits
  std::unique_lock<std::recursive_timed_mutex> alone_;
};

/// (kind, text) of an error, kinds by the exit codes of the program; None where there is none.
pybind11::object as_python(const Error& error);

}  // namespace bs::python
