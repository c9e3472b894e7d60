// Named groups of particles: by faces, boxes and rows.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "lattice/initial.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// What an option -bs_group_NAME says: the union of
///   xmin, xmax, ymin, ...      particles of a face of the lattice
///   box:LOW,...,HIGH,...       d + d numbers: particles in a box, its faces included [m]
///   ids:I,J,K-L,...            rows, counted from 0, and ranges of them, ends included
///   all                        every particle
/// separated by commas.
struct GroupSpec {
  std::string name;
  bool all = false;
  Faces faces = 0;
  std::vector<std::array<double, 6>> boxes;                   ///< lower corner, upper corner
  std::vector<std::pair<std::int64_t, std::int64_t>> ranges;  ///< first and last row
};

/// Letters, digits and underscores, beginning with a letter.
bool is_group_name(const std::string& name);

/// Reads `text` in d = `dim` dimensions for a lattice of `total` particles that extend along the first `axes` axes. Empty, or one line without
/// the option's name that says what to write instead.
std::string parse_group(const std::string& text, int dim, int axes, std::int64_t total, GroupSpec* out);

/// Adds the groups of `specs`, in their order, to the lattice's chunk; a group of the same name is replaced. `box` is that of all
/// particles, `depth` [m] how far inside it those of the faces xmin and xmax may be.
void choose_groups(const std::vector<GroupSpec>& specs, const Box& box, double depth, Lattice* lattice);

/// Fixes the members of the groups of these names; names that no group has are left to require_groups().
void fix_groups(const std::vector<std::string>& names, Lattice* lattice);

}  // namespace bs
