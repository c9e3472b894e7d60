// Lattices in memory for Python, and from and to files.
#include "session/lattices.hpp"
#include <pybind11/stl.h>
#include <algorithm>
#include "python/arrays.hpp"
#include "python/module.hpp"

namespace bs::python {
namespace {

template <class T>
using Given = py::array_t<T, py::array::c_style | py::array::forcecast>;

template <class T>
py::array_t<T> copy_of(const std::vector<T>& numbers) {
  return py::array_t<T>(static_cast<py::ssize_t>(numbers.size()), numbers.data());
}

/// A member of LatticeArrays as a property that takes any array of numbers and gives a flat one.
template <class T, class Part>
void property(py::class_<LatticeArrays>& one, const char* name, std::vector<T> Part::*member) {
  one.def_property(
      name, [member](const LatticeArrays& l) { return copy_of(l.*member); },
      [member](LatticeArrays& l, const Given<T>& array) { l.*member = vector_of(array); });
}

using NamedColumns = std::map<std::string, Given<double>>;

/// Columns by name as {name: numbers}, and back.
py::dict dict_of(const std::vector<Column>& columns) {
  py::dict all;
  for (const Column& column : columns) all[py::str(column.name)] = copy_of(column.value);
  return all;
}

std::vector<Column> columns_of(const NamedColumns& all) {
  std::vector<Column> columns;
  for (const auto& [name, numbers] : all) columns.push_back({name, {}, vector_of(numbers)});
  return columns;
}

void columns(py::class_<LatticeArrays>& one, const char* name, std::vector<Column> LatticeArrays::*member) {
  one.def_property(
      name, [member](const LatticeArrays& l) { return dict_of(l.*member); },
      [member](LatticeArrays& l, const NamedColumns& all) { l.*member = columns_of(all); });
}

void bind_parts(py::class_<LatticeArrays>& one) {
  one.def_property(
      "groups",
      [](const LatticeArrays& l) {
        py::dict all;
        for (const Group& group : l.groups) all[py::str(group.name)] = copy_of(group.member);
        return all;
      },
      [](LatticeArrays& l, const std::map<std::string, Given<std::uint8_t>>& all) {
        l.groups.clear();
        for (const auto& [name, member] : all) l.groups.push_back({name, vector_of(member)});
      });
  one.def_property(
      "box",
      [](const LatticeArrays& l) {
        return py::make_tuple(std::vector<bool>(l.box.periodic, l.box.periodic + l.dim),
                              std::vector<double>(l.box.edges.data(), l.box.edges.data() + l.dim * l.dim));
      },
      [](LatticeArrays& l, const std::pair<std::vector<bool>, std::vector<double>>& box) {
        l.box = {};
        std::copy(box.first.begin(), box.first.end(), l.box.periodic);
        std::copy(box.second.begin(), box.second.end(), l.box.edges.begin());
      });
  one.def_property(
      "anchors",
      [](const LatticeArrays& l) {
        const AnchorArrays& a = l.anchors;
        return py::make_tuple(copy_of(a.particle), copy_of(a.point), copy_of(a.stiffness), copy_of(a.rest_length), copy_of(a.damping));
      },
      [](LatticeArrays& l, const std::tuple<Given<std::int64_t>, Given<double>, Given<double>, Given<double>, Given<double>>& a) {
        l.anchors = {vector_of(std::get<0>(a)), vector_of(std::get<1>(a)), vector_of(std::get<2>(a)), vector_of(std::get<3>(a)),
                     vector_of(std::get<4>(a))};
      });
  one.def_property_readonly("interactions", [](const LatticeArrays& l) {
    py::dict all;
    for (const InteractionArrays& i : l.interactions)
      all[py::str(i.kind)] = py::make_tuple(copy_of(i.ends), copy_of(i.parameter), copy_of(i.shift), dict_of(i.break_columns));
    return all;
  });
  one.def("add_interactions", [](LatticeArrays& l, const std::string& kind, const Given<std::int64_t>& ends, const Given<double>& parameter,
                                 const Given<std::int64_t>& shift, const NamedColumns& limits) {
    l.interactions.push_back({kind, vector_of(ends), vector_of(parameter), vector_of(shift), columns_of(limits)});
  });
}

MPI_Comm communicator(std::int64_t handle) { return MPI_Comm_f2c(static_cast<MPI_Fint>(handle)); }

}  // namespace

void bind_lattices(py::module_& m) {
  py::class_<LatticeArrays> one(m, "LatticeArrays");
  one.def(py::init<>()).def_readwrite("dim", &LatticeArrays::dim);
  property(one, "position", &LatticeArrays::position);
  property(one, "velocity", &LatticeArrays::velocity);
  property(one, "mass", &LatticeArrays::mass);
  property(one, "fixed", &LatticeArrays::fixed);
  property(one, "id", &LatticeArrays::id);
  property(one, "springs", &LatticeArrays::springs);
  property(one, "stiffness", &LatticeArrays::stiffness);
  property(one, "rest_length", &LatticeArrays::rest_length);
  property(one, "damping", &LatticeArrays::damping);
  property(one, "area", &LatticeArrays::area);
  property(one, "shift", &LatticeArrays::shift);
  property(one, "law", &LatticeArrays::law);
  columns(one, "particle_columns", &LatticeArrays::particle_columns);
  columns(one, "spring_columns", &LatticeArrays::spring_columns);
  columns(one, "break_columns", &LatticeArrays::break_columns);
  one.def_readwrite("spring_law", &LatticeArrays::spring_law);
  one.def_readwrite("damping_law", &LatticeArrays::damping_law);
  one.def_readwrite("laws", &LatticeArrays::laws);
  one.def_readwrite("rest_at_zero_length", &LatticeArrays::rest_at_zero_length);
  one.def_readwrite("implied_options", &LatticeArrays::implied_options);
  bind_parts(one);

  m.def("nearest_images", [](const std::vector<double>& edges, const std::vector<bool>& periodic, const Given<double>& ways) {
    const std::size_t d = periodic.size(), n = static_cast<std::size_t>(ways.size()) / std::max<std::size_t>(d, 1);
    std::vector<std::int64_t> shift(n * d);
    PeriodicBox box;
    std::copy(periodic.begin(), periodic.end(), box.periodic);
    std::copy(edges.begin(), edges.end(), box.edges.begin());
    const NearestImages nearest(box, static_cast<int>(d));
    for (std::size_t k = 0; k < n; ++k) (void)nearest.find(ways.data() + k * d, shift.data() + k * d);
    return array_of(std::move(shift), {static_cast<py::ssize_t>(n), static_cast<py::ssize_t>(d)});
  });
  m.def("read_lattice", [](std::int64_t comm, const Settings& settings) {
    LatticeArrays arrays;
    std::vector<std::string> warnings;
    Error error;
    {
      const Turn turn;
      error = read_lattice(communicator(comm), settings, &arrays, &warnings);
    }
    return py::make_tuple(as_python(error), std::move(arrays), warnings);
  });
  m.def("write_lattice", [](std::int64_t comm, const LatticeArrays& arrays, const Settings& settings, const std::string& file) {
    std::vector<std::string> warnings;
    Error error;
    {
      const Turn turn;
      error = write_lattice(communicator(comm), arrays, settings, file, &warnings);
    }
    return py::make_tuple(as_python(error), warnings);
  });
}

}  // namespace bs::python
