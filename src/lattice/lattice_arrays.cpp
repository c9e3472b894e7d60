#include "lattice/lattice_arrays.hpp"
#include <algorithm>
#include <limits>
#include "lattice/columns.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {
namespace {

/// `otherwise` in all rows where none is given.
template <class T>
void fill(std::size_t size, T otherwise, std::vector<T>* given) {
  if (given->empty()) given->assign(size, otherwise);
}

/// With a name for messages where the caller gave none.
void name_paths(const std::string& group, std::vector<Column>* columns) {
  for (Column& one : *columns)
    if (one.path.empty()) one.path = group + "/" + one.name;
}

std::size_t place_of(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

/// What may be empty, and the rows that there are.
void complete(Lattice* l) {
  const std::size_t particles = l->mass.size(), springs = l->stiffness.size();
  const std::int64_t n = static_cast<std::int64_t>(particles), s = static_cast<std::int64_t>(springs);
  l->particles = {0, n, n};
  l->springs = {0, s, s};
  fill(l->position.size(), 0.0, &l->velocity);
  fill(particles, std::uint8_t{0}, &l->fixed);
  fill(springs, std::numeric_limits<double>::quiet_NaN(), &l->rest_length);
  fill(springs, 0.0, &l->damping);
  name_paths("particles", &l->particle_columns);
  name_paths("springs", &l->spring_columns);
  name_paths("springs", &l->break_columns);
  (void)complete_edges(&l->box, l->dim);
}

void take_laws(const LatticeArrays& a, Lattice* l) {
  std::vector<std::uint8_t> places;
  for (const std::string& name : a.laws) places.push_back(static_cast<std::uint8_t>(place_of(spring_law_names(), name)));
  for (const std::int64_t at : a.law) l->spring_laws.push_back(places[static_cast<std::size_t>(at)]);
  l->law_by_row = !a.law.empty();
  l->spring_law_given = !a.spring_law.empty();
  l->damping_law_given = !a.damping_law.empty();
  if (l->spring_law_given) l->spring_law = static_cast<SpringLaw>(place_of(spring_law_names(), a.spring_law));
  if (l->damping_law_given) l->damping_law = static_cast<DampingLaw>(place_of(damper_law_names(), a.damping_law));
}

void take_anchors(const AnchorArrays& a, Lattice* l) {
  const std::size_t size = a.stiffness.size();
  const std::int64_t n = static_cast<std::int64_t>(size);
  l->anchors = {0, n, n};
  l->anchor_particle = a.particle;
  l->anchor_point = a.point;
  l->anchor_stiffness = a.stiffness;
  l->anchor_rest_length = a.rest_length;
  l->anchor_damping = a.damping;
  fill(size, 0.0, &l->anchor_rest_length);
  fill(size, 0.0, &l->anchor_damping);
}

std::string kind_name(const InteractionSchema& schema) { return std::string(schema.group) + "s"; }

void take_interactions(const std::vector<InteractionArrays>& given, Lattice* l) {
  if (given.empty()) return;
  for (const InteractionSchema& schema : interaction_schemas()) {
    InteractionRows rows;
    for (const InteractionArrays& one : given) {
      if (one.kind != kind_name(schema)) continue;
      const std::int64_t n = static_cast<std::int64_t>(one.ends.size()) / schema.ends;
      rows = {{0, n, n}, one.ends, one.parameter, one.shift, one.break_columns};
      name_paths(one.kind, &rows.break_columns);
    }
    l->interactions.push_back(std::move(rows));
  }
}

}  // namespace

bool lattice_of(LatticeArrays a, Lattice* out, std::string* error) {
  *error = fault_of(a);
  if (!error->empty()) return false;
  Lattice l;
  l.source = IN_MEMORY;
  l.pairs = std::move(a.springs);
  if (!a.area.empty()) l.area = {AREA, std::string("springs/") + AREA, std::move(a.area)};
  take_laws(a, &l);
  take_anchors(a.anchors, &l);
  take_interactions(a.interactions, &l);
  static_cast<LatticeNumbers&>(l) = std::move(a);
  complete(&l);
  *out = std::move(l);
  return true;
}

LatticeArrays arrays_of(Lattice l) {
  LatticeArrays a;
  a.springs = std::move(l.pairs);
  a.area = std::move(l.area.value);
  a.anchors = {std::move(l.anchor_particle), std::move(l.anchor_point), std::move(l.anchor_stiffness), std::move(l.anchor_rest_length),
               std::move(l.anchor_damping)};
  for (std::size_t kind = 0; kind < l.interactions.size(); ++kind) {
    InteractionRows& rows = l.interactions[kind];
    if (rows.rows.total > 0)
      a.interactions.push_back({kind_name(interaction_schemas()[kind]), std::move(rows.ends), std::move(rows.parameter), std::move(rows.shift),
                                std::move(rows.break_columns)});
  }
  if (l.spring_law_given) a.spring_law = spring_law_names()[static_cast<std::size_t>(l.spring_law)];
  if (l.damping_law_given) a.damping_law = damper_law_names()[static_cast<std::size_t>(l.damping_law)];
  if (l.law_by_row) {
    a.laws = spring_law_names();
    a.law.assign(l.spring_laws.begin(), l.spring_laws.end());
  }
  static_cast<LatticeNumbers&>(a) = std::move(l);
  return a;
}

}  // namespace bs
