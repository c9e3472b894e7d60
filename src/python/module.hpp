// The parts of the Python module.
#pragma once
#include <pybind11/pybind11.h>

namespace bs::python {

void bind_sessions(pybind11::module_& m);

}  // namespace bs::python
