#include "systems/particles/lattice_tables.hpp"
#include "base/collective.hpp"
#include "base/hash.hpp"
#include "input/hdf5_layout.hpp"
#include "lattice/columns.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

namespace {

using Datasets = std::vector<Dataset>;

/// The names of all laws: what a spring's law is the place in.
std::string law_list() {
  std::string names;
  for (const std::string& name : spring_law_names()) names += (names.empty() ? "" : ",") + name;
  return names;
}

std::vector<std::int64_t> whole(const std::vector<std::uint8_t>& values) { return {values.begin(), values.end()}; }

/// A trajectory tells the ids of particles that have none of their own, which are their rows.
PetscErrorCode take_ids(MPI_Comm comm, const Hdf5Layout& names, Lattice* l, Datasets* out) {
  const Rows& p = l->particles;
  bool given = false;
  PetscFunctionBegin;
  PetscCall(on_some_rank(comm, !l->id.empty(), &given));
  if (!given) {
    if (!names.trajectory) PetscFunctionReturn(0);
    for (std::int64_t k = 0; k < p.count; ++k) l->id.push_back(p.first + k);
  }
  out->push_back({names.particle("id"), p.first, p.total, 0, std::move(l->id)});
  PetscFunctionReturn(0);
}

PetscErrorCode take_particles(MPI_Comm comm, const Hdf5Layout& names, Lattice* l, Datasets* out) {
  const Rows& p = l->particles;
  PetscFunctionBegin;
  if (!names.trajectory) {
    out->push_back({names.motion("position"), p.first, p.total, l->dim, std::move(l->position)});
    out->push_back({names.motion("velocity"), p.first, p.total, l->dim, std::move(l->velocity)});
  }
  out->push_back({names.particle("mass"), p.first, p.total, 0, std::move(l->mass)});
  PetscCall(take_ids(comm, names, l, out));
  out->push_back({names.particle("fixed"), p.first, p.total, 0, whole(l->fixed)});
  for (Column& column : l->particle_columns) {
    const ParticleParameter& one = particle_parameters[particle_parameter(column.name)];
    out->push_back({names.particle_column(one), p.first, p.total, one.vector ? l->dim : 0, std::move(column.value), {}, one.powers});
  }
  PetscFunctionReturn(0);
}

/// What the laws of springs take; of a lattice file what they carry, too.
void take_spring_columns(const Hdf5Layout& names, Lattice* l, Datasets* out) {
  const Rows& s = l->springs;
  for (Column& column : l->spring_columns) {
    for (const SpringParameter& one : spring_parameters())
      if (column.name == one.name) out->push_back({names.column(one.name), s.first, s.total, 0, std::move(column.value), {}, one.powers});
    for (const SpringHistory& one : spring_histories())
      if (column.name == one.name && !names.trajectory)
        out->push_back({names.history(one.name), s.first, s.total, 0, std::move(column.value), {}, one.powers});
  }
  if (l->has_area()) out->push_back({names.column(AREA), s.first, s.total, 0, std::move(l->area.value), {}, {0, 2, 0}});
  for (Column& column : l->break_columns) {
    for (const BreakLimit& one : break_limits)
      if (column.name == one.name) out->push_back({names.column(one.name), s.first, s.total, 0, std::move(column.value), {}, one.powers, true});
    if (column.name == BROKEN && !names.trajectory) out->push_back({names.history(BROKEN), s.first, s.total, 0, std::move(column.value)});
  }
}

/// Of stiffnesses: force per length, of springs of the strain law with a rest length force. None where there are both.
PetscErrorCode powers_of_stiffness(MPI_Comm comm, const Lattice& l, const std::vector<double>& rest_length, bool by_row, Powers* powers) {
  constexpr int strain = static_cast<int>(SpringLaw::strain);
  bool here[2] = {false, false}, anywhere[2];
  PetscFunctionBegin;
  for (std::size_t k = 0; k < rest_length.size(); ++k) {
    const int law = by_row ? l.spring_laws[k] : static_cast<int>(l.spring_law);
    here[law == strain && rest_length[k] != 0] = true;
  }
  for (int force = 0; force < 2; ++force) PetscCall(on_some_rank(comm, here[force], &anywhere[force]));
  *powers = anywhere[0] && anywhere[1] ? Powers{} : anywhere[1] ? Powers{1, 1, -2} : Powers{1, 0, -2};
  PetscFunctionReturn(0);
}

PetscErrorCode take_springs(MPI_Comm comm, const Hdf5Layout& names, Lattice* l, Datasets* out) {
  const Rows& s = l->springs;
  Powers of_stiffness;
  PetscFunctionBegin;
  if (s.total == 0) PetscFunctionReturn(0);
  PetscCall(powers_of_stiffness(comm, *l, l->rest_length, l->law_by_row, &of_stiffness));
  if (l->box.active()) out->push_back({names.column("shift"), s.first, s.total, l->dim, std::move(l->shift)});
  out->push_back({names.pairs(), s.first, s.total, 2, std::move(l->pairs)});
  out->push_back({names.column("stiffness"), s.first, s.total, 0, std::move(l->stiffness), {}, of_stiffness});
  out->push_back({names.column("rest_length"), s.first, s.total, 0, std::move(l->rest_length)});
  out->push_back({names.column("damping"), s.first, s.total, 0, std::move(l->damping)});
  take_spring_columns(names, l, out);
  if (!l->law_by_row) PetscFunctionReturn(0);
  out->push_back({names.column("law"), s.first, s.total, 0, whole(l->spring_laws)});
  if (names.trajectory) out->back().attributes = {{"spring_laws", law_list()}};  // of a lattice file they are the root's
  PetscFunctionReturn(0);
}

/// The springs to given points, which lie where they were at the start.
PetscErrorCode take_anchors(MPI_Comm comm, const Hdf5Layout& names, Lattice* l, Datasets* out) {
  const Rows& a = l->anchors;
  Powers of_stiffness;
  PetscFunctionBegin;
  if (a.total == 0) PetscFunctionReturn(0);
  PetscCall(powers_of_stiffness(comm, *l, l->anchor_rest_length, false, &of_stiffness));
  out->push_back({names.anchor("particle"), a.first, a.total, 0, l->anchor_particle});
  out->push_back({names.anchor("point"), a.first, a.total, l->dim, l->anchor_point, {}, {0, 1, 0}});
  out->push_back({names.anchor("stiffness"), a.first, a.total, 0, l->anchor_stiffness, {}, of_stiffness});
  out->push_back({names.anchor("rest_length"), a.first, a.total, 0, l->anchor_rest_length, {}, {0, 1, 0}});
  out->push_back({names.anchor("damping"), a.first, a.total, 0, l->anchor_damping, {}, {1, 0, -1}});
  PetscFunctionReturn(0);
}

/// As a trajectory's /connectivity/angles or a lattice file's /angles/triples and the like.
void take_interactions(bool trajectory, Lattice* lattice, Datasets* out) {
  for (std::size_t kind = 0; kind < lattice->interactions.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    InteractionRows& from = lattice->interactions[kind];
    const Rows rows = from.rows;
    if (rows.total == 0) continue;
    const std::size_t width = schema.parameters.size();
    for (std::size_t p = 0; p < width; ++p) {
      std::vector<double> column(static_cast<std::size_t>(rows.count));
      for (std::size_t k = 0; k < column.size(); ++k) column[k] = from.parameter[k * width + p];
      out->push_back({parameter_path(schema, schema.parameters[p].name, trajectory),
                      rows.first,
                      rows.total,
                      0,
                      std::move(column),
                      {},
                      schema.parameters[p].powers});
    }
    for (Column& column : from.break_columns) {
      for (const BreakLimit& one : turn_limits)
        if (column.name == one.name)
          out->push_back({parameter_path(schema, one.name, trajectory), rows.first, rows.total, 0, std::move(column.value), {}, one.powers, true});
      if (column.name == BROKEN && !trajectory) out->push_back({broken_path(schema, false), rows.first, rows.total, 0, std::move(column.value)});
    }
    if (lattice->box.active())
      out->push_back({parameter_path(schema, "shift", trajectory), rows.first, rows.total, schema.ends * lattice->dim, std::move(from.shift)});
    out->push_back({topology_path(schema, trajectory), rows.first, rows.total, schema.ends, std::move(from.ends)});
  }
  lattice->interactions.clear();
}

/// /groups/NAME: the rows of the particles of every group.
PetscErrorCode take_groups(MPI_Comm comm, const Lattice& l, Datasets* out) {
  PetscFunctionBegin;
  for (const Group& group : l.groups) {
    std::vector<std::int64_t> rows;
    for (std::size_t p = 0; p < group.member.size(); ++p)
      if (group.member[p]) rows.push_back(l.particles.first + static_cast<std::int64_t>(p));
    std::int64_t count = static_cast<std::int64_t>(rows.size()), sums[2] = {0, 0};
    PetscCallMPI(MPI_Scan(&count, &sums[0], 1, MPI_INT64_T, MPI_SUM, comm));
    PetscCallMPI(MPI_Allreduce(&count, &sums[1], 1, MPI_INT64_T, MPI_SUM, comm));
    out->push_back({"/groups/" + group.name, sums[0] - count, sums[1], 0, std::move(rows)});
  }
  PetscFunctionReturn(0);
}

/// Rank 0 writes the edges.
PetscErrorCode take_box(MPI_Comm comm, const Lattice& l, Datasets* out) {
  const std::int64_t d = l.dim;
  PetscFunctionBegin;
  if (!l.box.active()) PetscFunctionReturn(0);
  const int rank = rank_of(comm);
  out->push_back(
      {"/box/edges", 0, d, l.dim, rank == 0 ? std::vector<double>(l.box.edges.begin(), l.box.edges.begin() + d * d) : std::vector<double>{}});
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode take_tables(MPI_Comm comm, const Hdf5Layout& names, Lattice* l, std::vector<Dataset>* out) {
  PetscFunctionBegin;
  PetscCall(take_particles(comm, names, l, out));
  PetscCall(take_springs(comm, names, l, out));
  PetscCall(take_groups(comm, *l, out));
  PetscCall(take_anchors(comm, names, l, out));
  take_interactions(names.trajectory, l, out);
  if (!names.trajectory) PetscCall(take_box(comm, *l, out));
  PetscFunctionReturn(0);
}

std::vector<std::pair<std::string, std::string>> root_attributes(const Lattice& l) {
  std::vector<std::pair<std::string, std::string>> all;
  std::string options;
  if (l.spring_law_given) all.emplace_back("spring_law", spring_laws()[static_cast<std::size_t>(l.spring_law)].name);
  if (l.damping_law_given) all.emplace_back("damping_law", damper_laws()[static_cast<std::size_t>(l.damping_law)].first);
  if (l.law_by_row) all.emplace_back("spring_laws", law_list());
  for (const auto& [name, value] : l.implied_options) options += (options.empty() ? "" : " ") + name + " " + value;
  if (!options.empty()) all.emplace_back(IMPLIED_OPTIONS, options);
  if (l.rest_at_zero_length) all.emplace_back(FORCE_AT_ZERO_LENGTH, "none");
  return all;
}

void add_to_fingerprint(const Lattice& lattice, RowSum* sum) {
  constexpr std::uint64_t SHIFTS = 128, LIMITS = 256;
  for (std::size_t kind = 0; kind < lattice.interactions.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    const InteractionRows& from = lattice.interactions[kind];
    sum->add(INTERACTION_TABLES + 2 * kind, from.rows.first, schema.ends, from.ends);
    sum->add(INTERACTION_TABLES + 2 * kind + 1, from.rows.first, static_cast<int>(schema.parameters.size()), from.parameter);
    sum->add(SHIFTS + kind, from.rows.first, schema.ends * lattice.dim, from.shift);
    for (const Column& column : from.break_columns) {
      std::uint64_t c = 0;
      while (c < TURN_LIMITS && column.name != turn_limits[c].name) ++c;
      sum->add(LIMITS + (TURN_LIMITS + 1) * kind + c, from.rows.first, 1, column.value);
    }
  }
}

std::string count_text(const Network& net) {
  std::string text;
  for (std::size_t kind = 0; kind < net.interactions.size(); ++kind)
    if (net.interactions[kind].total > 0) text += ", " + std::to_string(net.interactions[kind].total) + " " + interaction_schemas()[kind].title + "s";
  return text;
}

}  // namespace bs
