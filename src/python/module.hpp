// The parts of the Python module.
#pragma once
#include <pybind11/pybind11.h>
#include "base/error.hpp"

namespace bs::python {

void bind_lattices(pybind11::module_& m);
void bind_sessions(pybind11::module_& m);

/// (kind, text) of an error, kinds by the exit codes of the program; None where there is none.
pybind11::object as_python(const Error& error);

}  // namespace bs::python
