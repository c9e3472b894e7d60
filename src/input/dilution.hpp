// Springs of a generated lattice that are left out by chance.
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

/// Local. Keeps the springs k of this rank with keep[k] != 0; their numbering is left to number_rows().
void keep_springs(const std::vector<std::uint8_t>& keep, Lattice* lattice);

/// Collective. Leaves out the angle springs of a generated lattice that do not lie along two springs of it.
PetscErrorCode keep_angles_along_springs(MPI_Comm comm, Lattice* lattice);

}  // namespace bs
