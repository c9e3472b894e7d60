#include "lattice/lattice_arrays.hpp"
#include <algorithm>
#include <limits>
#include "lattice/columns.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {
namespace {

template <class T>
std::vector<T> filled(std::vector<T> given, std::size_t size, T otherwise) {
  if (given.empty()) given.assign(size, otherwise);
  return given;
}

/// With a name for messages where the caller gave none.
std::vector<Column> named(std::vector<Column> columns, const char* of) {
  for (Column& one : columns)
    if (one.path.empty()) one.path = of + one.name;
  return columns;
}

std::size_t place_of(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

void take_springs(LatticeArrays& a, Lattice* l) {
  const std::size_t size = a.stiffness.size();
  const std::int64_t s = static_cast<std::int64_t>(size);
  l->springs = {0, s, s};
  l->pairs = std::move(a.springs);
  l->stiffness = std::move(a.stiffness);
  l->rest_length = filled(std::move(a.rest_length), size, std::numeric_limits<double>::quiet_NaN());
  l->damping = filled(std::move(a.damping), size, 0.0);
  l->spring_columns = named(std::move(a.spring_columns), "springs/");
  l->break_columns = named(std::move(a.break_columns), "springs/");
  if (!a.area.empty()) l->area = {AREA, std::string("springs/") + AREA, std::move(a.area)};
  l->box = a.box;
  (void)complete_edges(&l->box, a.dim);
  l->shift = std::move(a.shift);
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
  l->anchor_rest_length = filled(a.rest_length, size, 0.0);
  l->anchor_damping = filled(a.damping, size, 0.0);
}

std::string kind_name(const InteractionSchema& schema) { return std::string(schema.group) + "s"; }

void take_interactions(const std::vector<InteractionArrays>& given, Lattice* l) {
  if (given.empty()) return;
  for (const InteractionSchema& schema : interaction_schemas()) {
    InteractionRows rows;
    for (const InteractionArrays& one : given) {
      if (one.kind != kind_name(schema)) continue;
      const std::int64_t n = static_cast<std::int64_t>(one.ends.size()) / schema.ends;
      rows = {{0, n, n}, one.ends, one.parameter, one.shift, named(one.break_columns, (one.kind + "/").c_str())};
    }
    l->interactions.push_back(std::move(rows));
  }
}

}  // namespace

bool lattice_of(LatticeArrays a, Lattice* out, std::string* error) {
  *error = fault_of(a);
  if (!error->empty()) return false;
  const std::int64_t n = static_cast<std::int64_t>(a.mass.size());
  Lattice l;
  l.dim = a.dim;
  l.source = IN_MEMORY;
  l.particles = {0, n, n};
  l.velocity = filled(std::move(a.velocity), a.position.size(), 0.0);
  l.position = std::move(a.position);
  l.fixed = filled(std::move(a.fixed), a.mass.size(), std::uint8_t{0});
  l.mass = std::move(a.mass);
  l.id = std::move(a.id);
  l.particle_columns = named(std::move(a.particle_columns), "particles/");
  l.groups = std::move(a.groups);
  take_springs(a, &l);
  take_laws(a, &l);
  take_anchors(a.anchors, &l);
  take_interactions(a.interactions, &l);
  l.rest_at_zero_length = a.rest_at_zero_length;
  l.implied_options = a.implied_options;
  *out = std::move(l);
  return true;
}

LatticeArrays arrays_of(Lattice l) {
  LatticeArrays a;
  a.dim = l.dim;
  a.position = std::move(l.position);
  a.velocity = std::move(l.velocity);
  a.mass = std::move(l.mass);
  a.fixed = std::move(l.fixed);
  a.id = std::move(l.id);
  a.springs = std::move(l.pairs);
  a.stiffness = std::move(l.stiffness);
  a.rest_length = std::move(l.rest_length);
  a.damping = std::move(l.damping);
  a.area = std::move(l.area.value);
  a.particle_columns = std::move(l.particle_columns);
  a.spring_columns = std::move(l.spring_columns);
  a.break_columns = std::move(l.break_columns);
  a.groups = std::move(l.groups);
  a.box = l.box;
  a.shift = std::move(l.shift);
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
  a.rest_at_zero_length = l.rest_at_zero_length;
  a.implied_options = std::move(l.implied_options);
  return a;
}

}  // namespace bs
