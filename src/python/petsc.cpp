// PETSc's objects of a session as those of petsc4py, where it was there when the module was built.
#include "python/petsc.hpp"
#ifdef BS_PETSC4PY
#include <petsc4py/petsc4py.h>
#endif

namespace bs::python {

namespace py = pybind11;

py::object as_petsc4py(TS ts) {
#ifdef BS_PETSC4PY
  if (import_petsc4py() < 0) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(PyPetscTS_New(ts));
#else
  (void)ts;
  throw py::import_error("the extension was built without petsc4py: apt install python3-petsc4py, and build it again");
#endif
}

}  // namespace bs::python
