// One rank's rows of a lattice that every rank holds whole.
#include "input/load.hpp"

namespace bs {

template <class T>
static std::vector<T> slice(const std::vector<T>& all, const Rows& rows, int width) {
  if (all.empty()) return {};  // not given
  const auto first = all.begin() + rows.first * width;
  return std::vector<T>(first, first + rows.count * width);
}

Lattice chunk_of(const Lattice& whole, int rank, int size) {
  const Rows p = split_rows(whole.particles.total, rank, size), s = split_rows(whole.springs.total, rank, size),
             a = split_rows(whole.anchors.total, rank, size);
  Lattice l;
  l.dim = whole.dim;
  l.source = whole.source;
  l.spring_law = whole.spring_law;
  l.damping_law = whole.damping_law;
  l.spring_law_given = whole.spring_law_given;
  l.damping_law_given = whole.damping_law_given;
  l.rest_at_zero_length = whole.rest_at_zero_length;
  l.implied_options = whole.implied_options;
  l.warnings = whole.warnings;
  l.particles = p;
  l.position = slice(whole.position, p, l.dim);
  l.velocity = slice(whole.velocity, p, l.dim);
  l.mass = slice(whole.mass, p, 1);
  l.fixed = slice(whole.fixed, p, 1);
  l.id = slice(whole.id, p, 1);
  for (const Column& one : whole.particle_columns) l.particle_columns.push_back({one.name, one.path, slice(one.value, p, 1)});
  l.springs = s;
  l.pairs = slice(whole.pairs, s, 2);
  l.stiffness = slice(whole.stiffness, s, 1);
  l.rest_length = slice(whole.rest_length, s, 1);
  l.damping = slice(whole.damping, s, 1);
  l.law_by_row = whole.law_by_row;
  l.spring_laws = slice(whole.spring_laws, s, 1);
  for (const Column& one : whole.spring_columns) l.spring_columns.push_back({one.name, one.path, slice(one.value, s, 1)});
  l.anchors = a;
  l.anchor_particle = slice(whole.anchor_particle, a, 1);
  l.anchor_point = slice(whole.anchor_point, a, l.dim);
  l.anchor_stiffness = slice(whole.anchor_stiffness, a, 1);
  l.anchor_rest_length = slice(whole.anchor_rest_length, a, 1);
  l.anchor_damping = slice(whole.anchor_damping, a, 1);
  return l;
}

}  // namespace bs
