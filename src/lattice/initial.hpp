// Initial and boundary data laid over any set of particles, generated or read from a file that carries none.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "lattice/lattice.hpp"

namespace bs {

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

}  // namespace bs
