#include <algorithm>
#include <cinttypes>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "input/hdf5_layout.hpp"
#include "input/remote.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

std::string topology_path(const InteractionSchema& schema, bool trajectory) {
  const std::string group = std::string(schema.group) + "s";
  return trajectory ? "/connectivity/" + group : "/" + group + "/" + schema.topology;
}

std::string parameter_path(const InteractionSchema& schema, const std::string& name, bool trajectory) {
  const std::string group = std::string(schema.group) + "s";
  return trajectory ? "/connectivity/" + group + "_" + name : "/" + group + "/" + name;
}

std::string broken_path(const InteractionSchema& schema, bool trajectory) {
  return trajectory ? std::string("/backspring/") + BROKEN + "_" + schema.group + "s/value" : parameter_path(schema, BROKEN, false);
}

namespace {

PetscErrorCode read_kind(MPI_Comm comm, const Hdf5File& file, const InteractionSchema& schema, bool trajectory, const std::string& source,
                         InteractionRows* out) {
  Table topology;
  TableShape shape;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  shape.integers = true;
  shape.row_name = "A";
  shape.columns = schema.ends;
  PetscCall(file.find(topology_path(schema, trajectory), shape, &topology));
  PetscCall(file.require_data(topology));
  if (topology.rows > PETSC_MAX_INT / schema.ends)
    PetscCall(fail(comm, Exit::input,
                   format("%s: %" PRId64 " %ss are more than PETSc's indices can count; use a PETSc with 64-bit indices "
                          "(cmake -DBS_PETSC_MODULE=PETSc64)",
                          source.c_str(), topology.rows, schema.title)));
  out->rows = split_rows(topology.rows, rank, size);
  PetscCall(file.read(topology, out->rows.first, out->rows.count, 0, &out->ends));
  const std::size_t width = schema.parameters.size();
  out->parameter.resize(static_cast<std::size_t>(out->rows.count) * width);
  for (std::size_t p = 0; p < width; ++p) {
    std::vector<double> values;
    PetscCall(read_rows(file, parameter_path(schema, schema.parameters[p].name, trajectory), out->rows, "A", false, &values));
    for (std::size_t k = 0; k < values.size(); ++k) out->parameter[k * width + p] = values[k];
  }
  if (!schema.turns) PetscFunctionReturn(0);
  for (const BreakLimit& limit : turn_limits)
    PetscCall(add_column(file, {limit.name, parameter_path(schema, limit.name, trajectory), {}}, out->rows, "A", false, &out->break_columns));
  PetscCall(add_column(file, {BROKEN, broken_path(schema, trajectory), {}}, out->rows, "A", trajectory, &out->break_columns));
  PetscFunctionReturn(0);
}

/// Says where row `k` stands: "F: angle spring 3, /angles/stiffness".
std::string place(const Lattice& l, const InteractionSchema& schema, std::int64_t row, const std::string& dataset) {
  return l.source + ": " + schema.title + " " + std::to_string(row) + (l.has_datasets() ? ", " + dataset : "") + ": ";
}

void check_row(const Lattice& l, const InteractionSchema& schema, const InteractionRows& from, std::size_t k, Error* fault) {
  const std::int64_t row = from.rows.first + static_cast<std::int64_t>(k), *end = &from.ends[k * static_cast<std::size_t>(schema.ends)];
  const auto same = [&](int a, int b) {
    const std::int64_t* box = from.shift.empty() ? nullptr : &from.shift[k * static_cast<std::size_t>(schema.ends * l.dim)];
    return end[a] == end[b] && (!box || std::equal(box + a * l.dim, box + (a + 1) * l.dim, box + b * l.dim));
  };
  const std::string ends = place(l, schema, row, topology_path(schema, false));
  for (int a = 0; a < schema.ends; ++a) {
    if (end[a] < 0 || end[a] >= l.particles.total) {
      fault->note(row,
                  ends + format("there is no particle %" PRId64 "; write 0 to %" PRId64 " (particles count from 0)", end[a], l.particles.total - 1));
      return;
    }
    for (int b = 0; b < a; ++b)
      if (same(a, b)) fault->note(row, ends + format("names particle %" PRId64 " twice; give it %d different ends", end[a], schema.ends));
  }
  const double* p = &from.parameter[k * schema.parameters.size()];
  const char* remedy = nullptr;
  const int bad = schema.bad_parameter(p, l.dim, &remedy);
  if (bad < 0) return;
  const InteractionParameter& parameter = schema.parameters[static_cast<std::size_t>(bad)];
  fault->note(row, place(l, schema, row, parameter_path(schema, parameter.name, false)) + format("%s %.16g; %s", parameter.label, p[bad], remedy));
}

/// Ends of this chunk's rows where they start.
PetscErrorCode check_places(MPI_Comm comm, const Lattice& l, const InteractionSchema& schema, const InteractionRows& from) {
  const std::size_t d = static_cast<std::size_t>(l.dim), ends = static_cast<std::size_t>(schema.ends);
  std::vector<double> at;
  std::vector<const double*> x(ends);
  Error fault;
  PetscFunctionBegin;
  PetscCall(fetch_rows(comm, l.particles, l.position, l.dim, from.ends, &at));
  for (std::size_t k = 0; k < static_cast<std::size_t>(from.rows.count) && !fault; ++k) {
    for (std::size_t a = 0; a < ends; ++a) {
      x[a] = &at[(k * ends + a) * d];
      for (std::size_t q = 0; q < d && !from.shift.empty(); ++q)
        for (std::size_t c = 0; c < d; ++c)
          at[(k * ends + a) * d + c] += static_cast<double>(from.shift[(k * ends + a) * d + q]) * l.box.edges[q * d + c];
    }
    const std::int64_t row = from.rows.first + static_cast<std::int64_t>(k);
    if (const char* why = schema.fault(l.dim, x.data(), &from.parameter[k * schema.parameters.size()]))
      fault.note(row, place(l, schema, row, topology_path(schema, false)) + "starts with " + why + "; move a particle or leave it out");
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_interactions(MPI_Comm comm, const Hdf5File& file, bool trajectory, Lattice* l) {
  const std::vector<InteractionSchema>& schemas = interaction_schemas();
  PetscFunctionBegin;
  l->interactions.assign(schemas.size(), {});
  for (std::size_t kind = 0; kind < schemas.size(); ++kind)
    if (file.has(trajectory ? topology_path(schemas[kind], true) : std::string("/") + schemas[kind].group + "s"))
      PetscCall(read_kind(comm, file, schemas[kind], trajectory, l->source, &l->interactions[kind]));
  PetscFunctionReturn(0);
}

PetscErrorCode check_interactions(MPI_Comm comm, const Lattice& l) {
  PetscFunctionBegin;
  for (std::size_t kind = 0; kind < l.interactions.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    const InteractionRows& from = l.interactions[kind];
    Error fault;
    if (from.rows.total > 0 && l.dim < schema.least_dim)
      PetscCall(fail(comm, Exit::input,
                     format("%s: %ss need a lattice of at least %d dimensions, this one has %d; leave them out", l.source.c_str(), schema.title,
                            schema.least_dim, l.dim)));
    for (std::size_t k = 0; k < static_cast<std::size_t>(from.rows.count) && !fault; ++k) check_row(l, schema, from, k, &fault);
    PetscCall(fail_if_any(comm, fault));
    if (from.rows.total > 0) PetscCall(check_places(comm, l, schema, from));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
