// Sessions for Python: calls without the interpreter's lock, errors as (kind, text), signals and callbacks of Python between steps.
#include <algorithm>
#include <map>
#include <optional>
#include "python/petsc.hpp"
#include "python/python_session.hpp"

namespace bs::python {
namespace {

py::array table_of(FrameTable&& table) {
  const py::ssize_t rows = static_cast<py::ssize_t>(table.value.size()) / table.columns;
  if (table.columns == 1) return array_of(std::move(table.value), {rows});
  return array_of(std::move(table.value), {rows, table.columns});
}

py::dict parts_of(SavedState::Parts&& from) {
  py::dict all;
  for (auto& [name, rows] : from) {
    const py::ssize_t size = static_cast<py::ssize_t>(rows.size());
    all[py::str(name)] = array_of(std::move(rows), {size});
  }
  return all;
}

SavedState::Parts parts_from(const py::dict& all) {
  SavedState::Parts to;
  for (const auto& [name, rows] : all) to[name.cast<std::string>()] = vector_of(rows.cast<Numbers>());
  return to;
}

/// {"time": t, "state": {name: array}, "memory": {name: array}, "sums": {name: number}}: what a session may be given again, in this process or
/// another.
py::dict state_of(SavedState&& from) {
  py::dict all;
  all["time"] = from.time;
  all["state"] = parts_of(std::move(from.state));
  all["memory"] = parts_of(std::move(from.memory));
  all["sums"] = from.sums;
  return all;
}

SavedState state_from(const py::dict& all) {
  return {all["time"].cast<double>(), true, parts_from(all["state"]), parts_from(all["memory"]), all["sums"].cast<std::map<std::string, double>>()};
}

/// {"time": t, "observables": {name: numbers}, "fields": {name: array}, "breaks": {name: array}, "state", "reaction": of equilibria}.
py::dict frame_of(FrameData&& frame, int dim) {
  py::dict observables, fields, breaks, all;
  for (Observable& one : frame.observables) {
    const py::ssize_t size = static_cast<py::ssize_t>(one.value.size());
    if (size == 1) observables[py::str(one.name)] = py::float_(one.value[0]);
    else if (one.columns > 0) observables[py::str(one.name)] = array_of(std::move(one.value), {size / one.columns, one.columns});
    else observables[py::str(one.name)] = array_of(std::move(one.value), {size});
  }
  for (auto& [tables, to] : {std::tie(frame.tables, fields), std::tie(frame.breaks, breaks)})
    for (FrameTable& one : tables) {
      const py::str name(one.name);
      to[name] = table_of(std::move(one));
    }
  all["time"] = frame.time;
  all["observables"] = observables;
  all["fields"] = fields;
  all["breaks"] = breaks;
  all["state"] = state_of(std::move(frame.state));
  const py::ssize_t particles = static_cast<py::ssize_t>(frame.reaction.size()) / std::max(dim, 1);
  all["reaction"] = array_of(std::move(frame.reaction), {particles, dim});
  return all;
}

py::dict result_of(Result&& result, int dim) {
  py::dict all = frame_of(std::move(result.frame), dim);
  const py::ssize_t d = dim, modes = static_cast<py::ssize_t>(result.omega_squared.size()), shapes = static_cast<py::ssize_t>(result.shapes.size());
  py::ssize_t q = 0;
  while (q * q < static_cast<py::ssize_t>(result.stiffness.size())) ++q;
  all["load_factor"] = result.load_factor;
  all["steps"] = result.steps;
  all["rejected"] = result.rejected;
  all["newton"] = result.newton;
  all["krylov"] = result.krylov;
  all["zero_modes"] = result.zero_modes;
  all["stiffness"] = array_of(std::move(result.stiffness), {q, q});
  all["omega_squared"] = array_of(std::move(result.omega_squared), {modes});
  all["residual"] = array_of(std::move(result.residual), {modes});
  all["shapes"] = array_of(std::move(result.shapes), {modes, modes ? shapes / (modes * d) : 0, d});
  return all;
}

/// Callbacks may refer to what owns the session: Python's collector sees through it.
void collected(PyHeapTypeObject* of_type) {
  PyTypeObject& type = of_type->ht_type;
  type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  type.tp_traverse = [](PyObject* self, visitproc visit, void* arg) {
    Py_VISIT(Py_TYPE(self));
    const bool made = reinterpret_cast<py::detail::instance*>(self)->get_value_and_holder().holder_constructed();
    return made ? py::cast<PythonSession&>(py::handle(self)).traverse(visit, arg) : 0;
  };
  type.tp_clear = [](PyObject* self) {
    py::cast<PythonSession&>(py::handle(self)).let_go();
    return 0;
  };
}

/// (error, result) of an analysis.
template <class Analysis>
py::tuple analysed(PythonSession& s, Analysis&& analysis) {
  Result result;
  const Error error = s.call([&] { return analysis(&result); });
  return py::make_tuple(as_python(error), result_of(std::move(result), s->dim()));
}

Session::Array array_named(const std::string& name) {
  using A = Session::Array;
  return name == "position" ? A::position : name == "velocity" ? A::velocity : name == "force" ? A::force : A::reaction;
}

/// (error, array (N, d)) of all particles, or of this rank's rows.
py::tuple numbers_of(PythonSession& s, const std::string& name, bool whole) {
  std::vector<double> all;
  const Error error = s.call([&] { return whole ? s->get(array_named(name), &all) : s->get_rows(array_named(name), &all); }, true);
  const py::ssize_t d = s->dim();
  if (error) return py::make_tuple(as_python(error), py::none());
  const py::ssize_t rows = static_cast<py::ssize_t>(all.size()) / d;
  return py::make_tuple(py::none(), array_of(std::move(all), {rows, d}));
}

/// (error, array (N, d)) without a copy, which keeps the memory and may not be written to.
py::tuple view_of(PythonSession& s, const std::string& name) {
  Session::View view;
  const Error error = s.call([&] { return s->view(array_named(name), &view); }, true);
  if (error) return py::make_tuple(as_python(error), py::none());
  const py::capsule owner(new std::shared_ptr<const void>(std::move(view.memory)), [](void* kept) {
    PetscBool running = PETSC_FALSE;
    (void)PetscInitialized(&running);
    std::optional<Turn> turn;
    if (running) turn.emplace(true);
    delete static_cast<std::shared_ptr<const void>*>(kept);
  });
  const py::ssize_t size = sizeof(double);
  py::array_t<double> numbers({static_cast<py::ssize_t>(view.rows), static_cast<py::ssize_t>(s->dim())},
                              {static_cast<py::ssize_t>(view.stride) * size, size}, view.first, owner);
  numbers.attr("setflags")(py::arg("write") = false);
  return py::make_tuple(py::none(), numbers);
}

}  // namespace

void bind_sessions(py::module_& m) {
  py::class_<Session::State, std::shared_ptr<Session::State>> saved(m, "State");
  // it never changes, so that a copy is itself; it holds what a method remembers, by which a file alone can go on elsewhere
  saved.def("__copy__", [](const py::object& self) { return self; });
  saved.def("__deepcopy__", [](const py::object& self, const py::object&) { return self; });
  saved.def("__reduce_ex__", [](const py::object&, const py::object&) -> py::object {
    throw py::type_error("a state that save() returned stays in its process: write it by checkpoint(), and go on from there by Simulation.restart()");
  });
  py::class_<PythonSession> one(m, "Session", py::custom_type_setup(collected));
  one.def(py::init<std::int64_t, LatticeArrays&, const Settings&, const py::object&>());
  one.def_property_readonly("error", &PythonSession::error);
  one.def_property_readonly("time", [](PythonSession& s) { return s->time(); });
  one.def_property_readonly("steps", [](PythonSession& s) { return s->steps(); });
  one.def_property_readonly("rows", [](PythonSession& s) {
    const Rows rows = s->particles();
    return py::make_tuple(rows.first, rows.count);
  });
  one.def_property_readonly("warnings", [](PythonSession& s) { return s->warnings(); });
  one.def("prepare", [](PythonSession& s) { return as_python(s.call([&] { return s->prepare(); })); });
  one.def("step", [](PythonSession& s, std::int64_t count) { return as_python(s.call([&] { return s->step(count); })); });
  one.def("run_until", [](PythonSession& s, double t) { return as_python(s.call([&] { return s->run_until(t); })); });
  one.def("run_to_frame", [](PythonSession& s) {
    bool more = false;
    const Error error = s.call([&] { return s->run_to_frame(&more); });
    return py::make_tuple(as_python(error), more);
  });
  one.def("on_some_rank", &PythonSession::on_some);
  one.def("finish", [](PythonSession& s) { return as_python(s.call([&] { return s->finish(); })); });
  one.def("statics", [](PythonSession& s, const Settings& more) { return analysed(s, [&](Result* out) { return s->solve_statics(out, more); }); });
  one.def("follow", [](PythonSession& s) { return analysed(s, [&](Result* out) { return s->follow(out); }); });
  one.def("numbers", [](PythonSession& s, const std::string& name) {
    std::vector<double> all = s->numbers(name);
    const py::ssize_t count = static_cast<py::ssize_t>(all.size());
    return array_of(std::move(all), {count});
  });
  one.def("expect_changes", [](PythonSession& s) { s->expect_changes(); });
  one.def("set_numbers", [](PythonSession& s, const std::string& name, const Numbers& all) {
    const std::vector<double> numbers = vector_of(all);
    return as_python(s.call([&] { return s->set_numbers(name, numbers); }));
  });
  one.def("remove_springs",
          [](PythonSession& s, const std::vector<std::int64_t>& rows) { return as_python(s.call([&] { return s->remove_springs(rows); })); });
  one.def("sensitivities", [](PythonSession& s, const Numbers& slope) {
    const std::vector<double> numbers = vector_of(slope);
    SavedState::Parts found;
    const Error error = s.call([&] { return s->sensitivities(numbers, &found); });
    return py::make_tuple(as_python(error), parts_of(std::move(found)));
  });
  one.def("moduli", [](PythonSession& s, const Settings& more) { return analysed(s, [&](Result* out) { return s->moduli(out, more); }); });
  one.def("modes", [](PythonSession& s, std::optional<std::int64_t> count, const Settings& more, const std::optional<py::dict>& about) {
    const SavedState state = about ? state_from(*about) : SavedState{};
    return analysed(s, [&](Result* out) { return s->modes(count, out, more, about ? &state : nullptr); });
  });
  one.def("get", numbers_of);
  one.def("view", view_of);
  one.def("set_rows", [](PythonSession& s, const std::string& name, const Numbers& rows) {
    const std::vector<double> numbers = vector_of(rows);
    return as_python(s.call([&] { return s->set_rows(array_named(name), numbers); }));
  });
  one.def("drive", [](PythonSession& s, const std::string& group, double t, const Numbers& rows) {
    const std::vector<double> numbers = vector_of(rows);
    return as_python(s.call([&] { return s->drive(group, t, numbers); }));
  });
  one.def("save", [](PythonSession& s) {
    std::shared_ptr<const Session::State> state;
    const Error error = s.call([&] { return s->save(&state); }, true);
    return py::make_tuple(as_python(error), std::const_pointer_cast<Session::State>(state));
  });
  one.def("restore", [](PythonSession& s, const Session::State& state) { return as_python(s.call([&] { return s->restore(state); })); });
  one.def("inherit", [](PythonSession& s, const py::dict& equilibrium) {
    const SavedState state = state_from(equilibrium);
    return as_python(s.call([&] { return s->inherit(state); }));
  });
  for (const auto& [name, of] : {std::make_pair("stepper", &Session::stepper), std::make_pair("load_stepper", &Session::load_stepper)})
    one.def(name, [of = of](PythonSession& s) {
      TS ts = nullptr;
      const Error error = s.call([&] { return ((*s.operator->()).*of)(&ts); }, true);
      return py::make_tuple(as_python(error), error ? py::none() : as_petsc4py(ts));
    });
  one.def("frame", [](PythonSession& s) {
    FrameData frame;
    const Error error = s.call([&] { return s->get_frame(&frame); }, true);
    return py::make_tuple(as_python(error), frame_of(std::move(frame), s->dim()));
  });
  one.def("checkpoint", [](PythonSession& s, const std::string& file) { return as_python(s.call([&] { return s->checkpoint(file); })); });
  one.def("observe", &PythonSession::observe);
  one.def("close", [](PythonSession& s) { s.close(); });
}

}  // namespace bs::python
