// The Python module backspring._core: what Session offers, with NumPy's arrays. Checks of arguments, defaults and names are the package's, in Python.
#include "python/module.hpp"
#include <pybind11/stl.h>
#include <algorithm>
#include <memory>
#include "python/arrays.hpp"
#include "session/session.hpp"

namespace bs::python {

/// MPI and PETSc run from the first use to finish().
static std::unique_ptr<Library>& library() {
  static std::unique_ptr<Library> running;
  return running;
}

static bool start() {
  if (!library()) library() = std::make_unique<Library>();
  return library()->started();
}

/// A member of LatticeArrays as a property that takes any array of numbers.
template <class T>
static void property(py::class_<LatticeArrays>& one, const char* name, std::vector<T> LatticeArrays::*member) {
  one.def_property(
      name, [member](const LatticeArrays& l) { return py::array_t<T>(static_cast<py::ssize_t>((l.*member).size()), (l.*member).data()); },
      [member](LatticeArrays& l, const py::array_t<T, py::array::c_style | py::array::forcecast>& array) { l.*member = vector_of(array); });
}

static void bind_lattice(py::module_& m) {
  py::class_<LatticeArrays> one(m, "LatticeArrays");
  one.def(py::init<>()).def_readwrite("dim", &LatticeArrays::dim);
  property(one, "position", &LatticeArrays::position);
  property(one, "velocity", &LatticeArrays::velocity);
  property(one, "mass", &LatticeArrays::mass);
  property(one, "fixed", &LatticeArrays::fixed);
  property(one, "springs", &LatticeArrays::springs);
  property(one, "stiffness", &LatticeArrays::stiffness);
  property(one, "rest_length", &LatticeArrays::rest_length);
  property(one, "damping", &LatticeArrays::damping);
  property(one, "shift", &LatticeArrays::shift);
  using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
  using Flags = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;
  one.def("set_particle_column", [](LatticeArrays& l, const std::string& name, const Numbers& v) {
    set_column(&l.particle_columns, {name, {}, vector_of(v)});
  });
  one.def("set_spring_column", [](LatticeArrays& l, const std::string& name, const Numbers& v) {
    set_column(&l.spring_columns, {name, {}, vector_of(v)});
  });
  one.def("add_group", [](LatticeArrays& l, const std::string& name, const Flags& member) { l.groups.push_back({name, vector_of(member)}); });
  one.def("set_box", [](LatticeArrays& l, const std::vector<bool>& periodic, const std::vector<double>& edges) {
    l.box = {};
    std::copy(periodic.begin(), periodic.end(), l.box.periodic);
    std::copy(edges.begin(), edges.end(), l.box.edges.begin());
  });
}

PYBIND11_MODULE(_core, m) {
  m.def("start", start);
  m.def("finish", [] { library().reset(); });
  bind_lattice(m);
  bind_sessions(m);
}

}  // namespace bs::python
