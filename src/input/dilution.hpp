// Springs of a generated lattice that are left out by chance, and the particles that then bear nothing.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <vector>
#include "lattice/generator.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Collective. Leaves out springs of the lattice that generate() made, chosen by the seed alone: a number in [0, 1) is drawn for each spring by its
/// row, and the round(remove_fraction * springs) springs of the smallest go, of equal numbers those of the lower rows; with remove_each those whose
/// number is below remove_fraction. Angle springs go with a spring that they lie along. The lattice's source says how many springs went.
PetscErrorCode remove_springs(MPI_Comm comm, const GeneratorSpec& spec, Lattice* lattice);

/// Collective. Leaves out the particles of spec.prune, and the springs at them, of a lattice that generate() made; fixed ones and members of groups
/// stay. dangling: those with one spring or none. rattlers: those whose springs' directions are linearly independent: no tensions but 0 balance
/// there, so that at rest and without loads nothing that is left bears less. Either again and again until none goes; which go does not depend on the
/// order. Rows are numbered anew, and divided by split_rows(); ids are the rows before. The lattice's source says how many went. Error (exit 2): none
/// is left.
PetscErrorCode prune_particles(MPI_Comm comm, const GeneratorSpec& spec, Lattice* lattice);

/// Local. Keeps the springs k of this rank with keep[k] != 0; their numbering is left to number_rows().
void keep_springs(const std::vector<std::uint8_t>& keep, Lattice* lattice);

/// Local. The same of angle springs.
void keep_angles(const std::vector<std::uint8_t>& keep, Lattice* lattice);

/// Collective. Leaves out the angle springs of a generated lattice that do not lie along two springs of it.
PetscErrorCode keep_angles_along_springs(MPI_Comm comm, Lattice* lattice);

}  // namespace bs
