// NumPy's arrays and std::vector.
#pragma once
#include <pybind11/numpy.h>
#include <vector>

namespace bs::python {

namespace py = pybind11;

/// Of any shape, copied row by row; the caller has checked shapes.
template <class T>
std::vector<T> vector_of(const py::array_t<T, py::array::c_style | py::array::forcecast>& array) {
  return {array.data(), array.data() + array.size()};
}

/// Of the given shape; takes over the numbers.
template <class T>
py::array_t<T> array_of(std::vector<T>&& numbers, const std::vector<py::ssize_t>& shape) {
  auto* const kept = new std::vector<T>(std::move(numbers));
  const py::capsule owner(kept, [](void* all) { delete static_cast<std::vector<T>*>(all); });
  return py::array_t<T>(shape, kept->data(), owner);
}

}  // namespace bs::python
