// Named groups of particles: by faces, boxes and rows.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include "lattice/lattice.hpp"

namespace bs {

// Initial and boundary data laid over any set of particles, generated or read from a file that carries none.

/// Smallest box, parallel to the axes, that holds every particle of every rank [m]. Unused axes: 0.
struct Box {
  double lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};
};

/// Faces of the box as bits: 1 << (2 axis) for the lower, 1 << (2 axis + 1) for the upper one.
using Faces = unsigned;

/// Reads names among xmin, xmax, ymin, ymax, zmin, zmax, of which only those of the first `axes` axes exist.
/// Returns an empty string, or one line that says what to write instead.
std::string parse_faces(const std::vector<std::string>& names, int axes, Faces* faces);

/// Sets fixed[p] = 1 for each particle not more than `depth` [m] inside one of `faces` (plus rounding);
/// position is (n, dim), fixed (n).
void apply_faces(Faces faces, const Box& box, double depth, int dim, const std::vector<double>& position, std::vector<std::uint8_t>* fixed);

/// Sets fixed = 1 for the global rows in `ids` that lie in the chunk `rows`; others are passed over.
void apply_fixed_particles(const std::vector<std::int64_t>& ids, const Rows& rows, std::vector<std::uint8_t>* fixed);

/// v = u + A x [m/s], 0 for fixed particles. position and velocity are (n, dim), `u` up to dim numbers (the rest 0),
/// `gradient` A is (dim, dim) row by row [1/s] or empty; `fixed` (n) or empty.
void apply_velocity(const std::vector<double>& u, const std::vector<double>& gradient, int dim, const std::vector<double>& position,
                    const std::vector<std::uint8_t>& fixed, std::vector<double>* velocity);

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
