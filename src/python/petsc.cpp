// PETSc's objects of a session as those of petsc4py, where the one of this PETSc was there when the module was built.
#include "python/petsc.hpp"
#ifndef BS_WITHOUT_PETSC4PY
#include <petsc4py/petsc4py.h>
#endif

namespace bs::python {

namespace py = pybind11;

py::object as_petsc4py(TS ts) {
#ifndef BS_WITHOUT_PETSC4PY
  if (import_petsc4py() < 0) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(PyPetscTS_New(ts));
#else
  (void)ts;
  throw py::import_error("the extension was built without petsc4py: " BS_WITHOUT_PETSC4PY ", and build it again");
#endif
}

}  // namespace bs::python
