#include "input/remote.hpp"
#include "base/collective.hpp"
#include "base/memory.hpp"
#include "lattice/columns.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

PetscErrorCode number_rows(MPI_Comm comm, Rows* rows) {
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  rows->first = 0;
  PetscCallMPI(MPI_Exscan(&rows->count, &rows->first, 1, MPI_INT64_T, MPI_SUM, comm));
  if (rank == 0) rows->first = 0;  // MPI_Exscan leaves it undefined there
  PetscCallMPI(MPI_Allreduce(&rows->count, &rows->total, 1, MPI_INT64_T, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

namespace {

/// Columns of `rows` by the names of `from`; width(name): numbers of a row.
template <class Take, class Width>
void retake_columns(const std::vector<Column>& from, const Rows& rows, Take&& take, Width&& width, std::vector<Column>* to) {
  for (const Column& one : from) {
    to->push_back({one.name, one.path, {}});
    take(one.value, rows, width(one.name), &to->back().value);
  }
}

template <class Take>
void retake_particles(const Lattice& from, Take&& take, Lattice* to) {
  const Rows& p = from.particles;
  take(from.position, p, from.dim, &to->position);
  take(from.velocity, p, from.dim, &to->velocity);
  take(from.mass, p, 1, &to->mass);
  take(from.fixed, p, 1, &to->fixed);
  take(from.id, p, 1, &to->id);
  retake_columns(
      from.particle_columns, p, take, [&from](const std::string& name) { return particle_parameters[particle_parameter(name)].width(from.dim); },
      &to->particle_columns);
  for (const Group& one : from.groups) {
    to->groups.push_back({one.name, {}});
    take(one.member, p, 1, &to->groups.back().member);
  }
}

template <class Take>
void retake_springs(const Lattice& from, Take&& take, Lattice* to) {
  const Rows& s = from.springs;
  const auto one_number = [](const std::string&) { return 1; };
  take(from.pairs, s, 2, &to->pairs);
  take(from.stiffness, s, 1, &to->stiffness);
  take(from.rest_length, s, 1, &to->rest_length);
  take(from.damping, s, 1, &to->damping);
  take(from.shift, s, from.dim, &to->shift);
  take(from.spring_laws, s, 1, &to->spring_laws);
  retake_columns(from.spring_columns, s, take, one_number, &to->spring_columns);
  retake_columns(from.break_columns, s, take, one_number, &to->break_columns);
  to->area = {from.area.name, from.area.path, {}};
  take(from.area.value, s, 1, &to->area.value);
}

template <class Take>
void retake_anchors(const Lattice& from, Take&& take, Lattice* to) {
  const Rows& a = from.anchors;
  take(from.anchor_particle, a, 1, &to->anchor_particle);
  take(from.anchor_point, a, from.dim, &to->anchor_point);
  take(from.anchor_stiffness, a, 1, &to->anchor_stiffness);
  take(from.anchor_rest_length, a, 1, &to->anchor_rest_length);
  take(from.anchor_damping, a, 1, &to->anchor_damping);
}

/// `from` with other rows: number(rows) says which, take(values, rows, width, out) gets them of one array.
template <class Number, class Take>
Lattice with_rows(const Lattice& from, Number&& number, Take&& take) {
  Lattice to;
  to.dim = from.dim;
  to.source = from.source;
  to.box = from.box;
  to.law_by_row = from.law_by_row;
  to.spring_law = from.spring_law;
  to.damping_law = from.damping_law;
  to.spring_law_given = from.spring_law_given;
  to.damping_law_given = from.damping_law_given;
  to.rest_at_zero_length = from.rest_at_zero_length;
  to.implied_options = from.implied_options;
  to.warnings = from.warnings;
  to.particles = number(from.particles);
  to.springs = number(from.springs);
  to.anchors = number(from.anchors);
  retake_particles(from, take, &to);
  retake_springs(from, take, &to);
  retake_anchors(from, take, &to);
  for (std::size_t kind = 0; kind < from.interactions.size(); ++kind) {
    const InteractionRows& one = from.interactions[kind];
    const InteractionSchema& schema = interaction_schemas()[kind];
    InteractionRows rows;
    rows.rows = number(one.rows);
    take(one.ends, one.rows, schema.ends, &rows.ends);
    take(one.parameter, one.rows, static_cast<int>(schema.parameters.size()), &rows.parameter);
    take(one.shift, one.rows, schema.ends * from.dim, &rows.shift);
    retake_columns(
        one.break_columns, one.rows, take, [](const std::string&) { return 1; }, &rows.break_columns);
    to.interactions.push_back(std::move(rows));
  }
  return to;
}

}  // namespace

Lattice chunk_of(const Lattice& whole, int rank, int size) {
  const auto number = [rank, size](const Rows& rows) { return split_rows(rows.total, rank, size); };
  return with_rows(whole, number, [&number](const auto& all, const Rows& rows, int width, auto* out) {
    if (all.empty()) return;  // not given
    const Rows own = number(rows);
    out->assign(all.begin() + own.first * width, all.begin() + (own.first + own.count) * width);
  });
}

PetscErrorCode gather_whole(MPI_Comm comm, const Lattice& chunk, Lattice* whole) {
  const LatticeSize size{chunk.particles.total, chunk.springs.total, chunk.anchors.total, chunk.dim};
  PetscErrorCode code = 0;
  PetscFunctionBegin;
  PetscCall(reserve_memory(comm, {chunk.source + ": the whole lattice on every rank", chunk_bytes(size, 1), "take fewer ranks"}));
  *whole = with_rows(
      chunk,
      [](const Rows& rows) {
        return Rows{0, rows.total, rows.total};
      },
      [&](const auto& own, const Rows&, int, auto* all) {
        if (!code) code = gather_all(comm, own, all);
      });
  PetscFunctionReturn(code);
}

}  // namespace bs
