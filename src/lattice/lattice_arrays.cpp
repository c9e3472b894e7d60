#include "lattice/lattice_arrays.hpp"
#include <limits>
#include "base/text.hpp"
#include "lattice/columns.hpp"

namespace bs {
namespace {

/// What is wrong with an array that should have `rows` rows of `width` numbers, or may be empty.
std::string misfit(const std::string& name, std::size_t size, std::size_t rows, std::size_t width, bool optional) {
  if (size == rows * width || (optional && size == 0)) return {};
  return "lattice in memory: " + name + " has " + how_many(static_cast<std::int64_t>(size), "number") + ": give " + std::to_string(rows * width) +
         (optional ? ", or none" : "");
}

template <class T>
std::vector<T> filled(const std::vector<T>& given, std::size_t size, T otherwise) {
  return given.empty() ? std::vector<T>(size, otherwise) : given;
}

std::string misfit_of(const LatticeArrays& a) {
  if (a.dim < 1 || a.dim > 3) return "lattice in memory: dim is " + std::to_string(a.dim) + ": give 1, 2 or 3";
  const std::size_t d = static_cast<std::size_t>(a.dim), n = a.mass.size(), s = a.stiffness.size();
  std::string wrong;
  const auto look = [&](const std::string& name, std::size_t size, std::size_t rows, std::size_t width, bool optional) {
    if (wrong.empty()) wrong = misfit(name, size, rows, width, optional);
  };
  if (n == 0) return "lattice in memory: mass is empty: give at least one particle";
  look("position", a.position.size(), n, d, false);
  look("velocity", a.velocity.size(), n, d, true);
  look("fixed", a.fixed.size(), n, 1, true);
  look("springs", a.springs.size(), s, 2, false);
  look("rest_length", a.rest_length.size(), s, 1, true);
  look("damping", a.damping.size(), s, 1, true);
  look("shift", a.shift.size(), s, d, true);
  for (const Column& one : a.particle_columns) {
    std::size_t width = 1;
    for (const ParticleParameter& known : particle_parameters)
      if (one.name == known.name) width = static_cast<std::size_t>(known.width(a.dim));
    look("particles/" + one.name, one.value.size(), n, width, false);
  }
  for (const Column& one : a.spring_columns) look("springs/" + one.name, one.value.size(), s, 1, false);
  for (const Group& one : a.groups) look("group " + one.name, one.member.size(), n, 1, false);
  return wrong;
}

}  // namespace

bool lattice_of(const LatticeArrays& a, Lattice* out, std::string* error) {
  *error = misfit_of(a);
  if (!error->empty()) return false;
  const std::int64_t n = static_cast<std::int64_t>(a.mass.size()), s = static_cast<std::int64_t>(a.stiffness.size());
  Lattice l;
  l.dim = a.dim;
  l.source = "lattice in memory";
  l.particles = {0, n, n};
  l.position = a.position;
  l.velocity = filled(a.velocity, a.position.size(), 0.0);
  l.mass = a.mass;
  l.fixed = filled(a.fixed, a.mass.size(), std::uint8_t{0});
  l.springs = {0, s, s};
  l.pairs = a.springs;
  l.stiffness = a.stiffness;
  l.rest_length = filled(a.rest_length, a.stiffness.size(), std::numeric_limits<double>::quiet_NaN());
  l.damping = filled(a.damping, a.stiffness.size(), 0.0);
  l.particle_columns = a.particle_columns;
  l.spring_columns = a.spring_columns;
  l.groups = a.groups;
  l.box = a.box;
  l.shift = a.shift;
  *out = std::move(l);
  return true;
}

}  // namespace bs
