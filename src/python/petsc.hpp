// PETSc's objects of a session as those of petsc4py.
#pragma once
#include <petscts.h>
#include <pybind11/pybind11.h>

namespace bs::python {

/// petsc4py.PETSc.TS of `ts`. Throws ImportError where petsc4py is missing.
pybind11::object as_petsc4py(TS ts);

}  // namespace bs::python
