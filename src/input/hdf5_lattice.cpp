#include <cinttypes>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "input/adjust.hpp"
#include "input/hdf5_file.hpp"
#include "input/hdf5_layout.hpp"
#include "lattice/columns.hpp"
#include "lattice/spring_laws.hpp"
#include "network/migrate.hpp"

namespace bs {

namespace {

/// read_rows of a dataset that the file may lack: `missing` everywhere.
PetscErrorCode read_optional(const Hdf5File& file, const std::string& path, const Rows& rows, const char* row_name, double missing,
                             std::vector<double>* out) {
  if (file.has(path)) return read_rows(file, path, rows, row_name, false, out);
  out->assign(static_cast<std::size_t>(rows.count), missing);
  return 0;
}

/// NaN stands for "the initial distance" further on, so a file's own NaN must be caught here.
PetscErrorCode reject_nan(MPI_Comm comm, const Lattice& l, const std::string& path) {
  Error fault;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < l.rest_length.size() && !fault; ++k)
    if (!std::isfinite(l.rest_length[k])) {
      const std::int64_t row = l.springs.first + static_cast<std::int64_t>(k);
      fault.note(row, format("%s: spring %" PRId64 ", %s: rest length %g; write a finite length >= 0 [m], or leave the "
                             "dataset out for the initial distances",
                             l.source.c_str(), row, path.c_str(), l.rest_length[k]));
    }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode read_fixed(MPI_Comm comm, const Hdf5File& file, const std::string& path, Lattice* l) {
  std::vector<std::int64_t> flags;
  Error fault;
  PetscFunctionBegin;
  l->fixed.assign(static_cast<std::size_t>(l->particles.count), 0);
  if (!file.has(path)) PetscFunctionReturn(0);
  PetscCall(read_rows(file, path, l->particles, "N", false, &flags, 0, true));
  for (std::size_t k = 0; k < flags.size() && !fault; ++k) {
    const std::int64_t row = l->particles.first + static_cast<std::int64_t>(k);
    if (flags[k] != 0 && flags[k] != 1)
      fault.note(row,
                 format("%s: particle %" PRId64 ", %s: %" PRId64 "; write 1 (fixed) or 0 (free)", l->source.c_str(), row, path.c_str(), flags[k]));
    l->fixed[k] = flags[k] != 0;
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

/// Finds the two or three tables that say how many rows there are, and checks the numbers before anything is read.
PetscErrorCode read_sizes(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& names, Lattice* l, Table* position, Table* pairs, Table* anchors) {
  TableShape points, ends, particle;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  points.columns = TableShape::any;
  points.frames = names.trajectory;
  PetscCall(file.find(names.motion("position"), points, position));
  l->dim = position->columns;
  if (names.trajectory) l->dim = lattice_dimension(file, position->columns);
  if (file.has(names.springs())) {
    ends.integers = true;
    ends.row_name = "M";
    ends.columns = 2;
    PetscCall(file.find(names.pairs(), ends, pairs));
  }
  if (file.has(names.anchor("particle"))) {
    particle.integers = true;
    particle.row_name = "A";
    PetscCall(file.find(names.anchor("particle"), particle, anchors));
  }
  PetscCall(check_sizes(comm, l->source, position->rows, l->dim, pairs->rows, anchors->rows));
  // Every other table is measured against these.
  for (const Table* table : {position, pairs, anchors}) PetscCall(file.require_data(*table));
  PetscCall(reserve_lattice(comm, l->source, {position->rows, pairs->rows, anchors->rows, l->dim}));
  l->particles = split_rows(position->rows, rank, size);
  l->springs = split_rows(pairs->rows, rank, size);
  l->anchors = split_rows(anchors->rows, rank, size);
  PetscFunctionReturn(0);
}

PetscErrorCode read_particles(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& names, const Table& position, Lattice* l) {
  const Rows& rows = l->particles;
  PetscFunctionBegin;
  PetscCall(file.read(position, rows.first, rows.count, l->dim, &l->position));
  if (file.has(names.motion("velocity"))) {
    Table velocity;
    TableShape shape;
    shape.rows = rows.total;
    shape.columns = position.columns;
    shape.frames = names.trajectory;
    PetscCall(file.find(names.motion("velocity"), shape, &velocity));
    PetscCall(file.read(velocity, rows.first, rows.count, l->dim, &l->velocity));
  } else {
    l->velocity.assign(l->position.size(), 0.0);
  }
  PetscCall(read_rows(file, names.particle("mass"), rows, "N", false, &l->mass));
  for (const ParticleParameter& one : particle_parameters)
    PetscCall(add_column(file, {one.name, names.particle_column(one), {}}, rows, "N", false, &l->particle_columns, one.vector ? l->dim : 0));
  if (file.has(names.particle("id"))) PetscCall(read_rows(file, names.particle("id"), rows, "N", false, &l->id));
  PetscCall(read_fixed(comm, file, names.particle("fixed"), l));
  PetscFunctionReturn(0);
}

/// Trajectories of earlier versions do not say how fast their box is strained.
PetscErrorCode warn_of_flow(const Hdf5File& file, Lattice* l) {
  std::string task;
  PetscFunctionBegin;
  PetscCall(file.text_attribute("/parameters/options", "bs_task", &task));
  if (!task.empty() && task != "dynamics") PetscFunctionReturn(0);
  for (const char* const option : {"bs_box_strain", "bs_box_rate"}) {
    std::string text;
    PetscCall(file.text_attribute("/parameters/options", option, &text));
    if (!text.empty())
      l->warnings.push_back(l->source + ": its box is strained (-" + option + "), and it has no " + BOX_FLOW +
                            ": its velocities are taken with the flow of the box, which a run that strains the box adds once more; write the "
                            "trajectory anew, or give velocities of your own");
  }
  PetscFunctionReturn(0);
}

/// Velocities of a lattice are beside the flow of the box, which a motion adds; those of a trajectory contain it.
PetscErrorCode take_flow_away(const Hdf5File& file, Lattice* l) {
  const std::size_t d = static_cast<std::size_t>(l->dim);
  const std::string path = std::string(BOX_FLOW) + "/value";
  Table table;
  TableShape shape;
  std::vector<double> L;
  PetscFunctionBegin;
  if (!file.has(path)) {
    PetscCall(warn_of_flow(file, l));
    PetscFunctionReturn(0);
  }
  shape.rows = shape.columns = l->dim;
  shape.frames = true;
  PetscCall(file.find(path, shape, &table));
  PetscCall(file.read(table, 0, l->dim, l->dim, &L));
  for (std::size_t p = 0; p < l->velocity.size(); ++p)
    for (std::size_t c = 0; c < d; ++c) l->velocity[p] -= L[p % d * d + c] * l->position[p / d * d + c];
  PetscFunctionReturn(0);
}

/// What laws of springs take and carry, as far as the file holds it.
PetscErrorCode read_spring_columns(const Hdf5File& file, const Hdf5Layout& names, Lattice* l) {
  std::vector<Column> area;
  PetscFunctionBegin;
  for (const SpringParameter& one : spring_parameters())
    PetscCall(add_column(file, {one.name, names.column(one.name), {}}, l->springs, "M", false, &l->spring_columns));
  for (const SpringHistory& one : spring_histories())
    PetscCall(add_column(file, {one.name, names.history(one.name), {}}, l->springs, "M", names.trajectory, &l->spring_columns));
  for (const BreakLimit& one : break_limits)
    PetscCall(add_column(file, {one.name, names.column(one.name), {}}, l->springs, "M", false, &l->break_columns));
  PetscCall(add_column(file, {AREA, names.column(AREA), {}}, l->springs, "M", false, &area));
  if (!area.empty()) l->area = std::move(area[0]);
  PetscCall(add_column(file, {BROKEN, names.history(BROKEN), {}}, l->springs, "M", names.trajectory, &l->break_columns));
  PetscFunctionReturn(0);
}

PetscErrorCode read_springs(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& names, const Table& pairs, Lattice* l) {
  const Rows& rows = l->springs;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  PetscFunctionBegin;
  if (!pairs.dataset) PetscFunctionReturn(0);
  PetscCall(file.read(pairs, rows.first, rows.count, 0, &l->pairs));
  PetscCall(read_rows(file, names.column("stiffness"), rows, "M", false, &l->stiffness));
  PetscCall(read_optional(file, names.column("damping"), rows, "M", 0, &l->damping));
  PetscCall(read_optional(file, names.column("rest_length"), rows, "M", nan, &l->rest_length));
  if (file.has(names.column("rest_length"))) PetscCall(reject_nan(comm, *l, names.column("rest_length")));
  PetscCall(read_row_laws(comm, file, names, l));
  PetscCall(read_spring_columns(file, names, l));
  PetscFunctionReturn(0);
}

PetscErrorCode read_anchors(const Hdf5File& file, const Hdf5Layout& names, const Table& anchors, Lattice* l) {
  const Rows& rows = l->anchors;
  PetscFunctionBegin;
  if (!anchors.dataset) PetscFunctionReturn(0);
  PetscCall(file.read(anchors, rows.first, rows.count, 0, &l->anchor_particle));
  PetscCall(read_rows(file, names.anchor("point"), rows, "A", false, &l->anchor_point, l->dim));
  PetscCall(read_rows(file, names.anchor("stiffness"), rows, "A", false, &l->anchor_stiffness));
  PetscCall(read_optional(file, names.anchor("rest_length"), rows, "A", 0, &l->anchor_rest_length));
  PetscCall(read_optional(file, names.anchor("damping"), rows, "A", 0, &l->anchor_damping));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_hdf5_lattice(MPI_Comm comm, const std::string& path, Lattice* out) {
  Hdf5File file;
  Table position, pairs, anchors;
  PetscFunctionBegin;
  *out = Lattice{};
  out->source = path;
  PetscCall(file.open(comm, path));
  const Hdf5Layout names = layout_of(file);
  PetscCall(read_sizes(comm, file, names, out, &position, &pairs, &anchors));
  PetscCall(read_laws(comm, file, names, out));
  PetscCall(read_particles(comm, file, names, position, out));
  PetscCall(read_springs(comm, file, names, pairs, out));
  PetscCall(read_interactions(comm, file, names.trajectory, out));
  PetscCall(read_hdf5_box(comm, file, names, out));
  if (names.trajectory) PetscCall(take_flow_away(file, out));
  PetscCall(read_anchors(file, names, anchors, out));
  PetscCall(read_hdf5_groups(comm, file, out));
  if (!names.trajectory) PetscCall(read_scene_attributes(comm, file, out));
  if (!names.trajectory) note_unknown_members(file, out);
  PetscFunctionReturn(0);
}

}  // namespace bs
