// Lattices in HDF5: the program's own schema, or the last frame of a trajectory it wrote.
#pragma once
#include <petscsys.h>
#include <string>

#include "lattice/lattice.hpp"

namespace bs {

/// Collective. Each rank reads its rows of the lattice in file `path`, and no others.
///
/// /particles/position (N,d), /particles/mass (N); optional velocity (N,d), fixed (N) of 0 and 1, id (N), and the columns (N) of
/// lattice/columns.hpp by their names (radius, drag).
/// /springs, optional: pairs (M,2) 0-based, stiffness (M); optional rest_length (M; absent: NaN), damping (M).
/// Optional, too: law (M), places in the list of names that is the attribute spring_laws of /; columns (M) of what the laws take
/// and carry, by their names in physics/pair/springs/registry.hpp (stiffness_2, yield_force, plastic_stretch, ...).
/// /anchors, optional: particle (A), point (A,d), stiffness (A); optional rest_length (A; absent: 0), damping (A).
/// /angles, optional: triples (A,3), the middle particle second, stiffness (A), rest_angle (A).
/// Attributes of /: spring_law and damping_law, names from physics/pair/springs/registry.hpp.
/// A file with /particles/trajectory/position/value is a trajectory: its last frame, /connectivity/bonds,
/// /connectivity/angles, and the laws among its /parameters/options, or of each spring in /connectivity/bonds_law.
///
/// Errors (exit 2): what cannot be opened, shapes, types, sizes, unknown laws, `fixed` that is not 0 or 1, rest lengths
/// that are not finite. Other values are left to validate().
PetscErrorCode read_hdf5_lattice(MPI_Comm comm, const std::string& path, Lattice* out);

}  // namespace bs
