// Where lattices and trajectories keep what in an HDF5 file, and what the file says about itself.
#pragma once
#include <petscsys.h>
#include <string>

#include "input/hdf5_file.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Where a kind of file keeps what.
struct Hdf5Layout {
  bool trajectory;
  std::string position, velocity, mass, fixed, radius, id;
  std::string springs, pairs, stiffness, rest_length, damping;
};

/// The layout of `file`: a trajectory's where it has frames, else a lattice's.
const Hdf5Layout& layout_of(const Hdf5File& file);

/// Local. d of a trajectory whose positions have `columns` components: those written as padding do not count.
int box_dimension(const Hdf5File& file, int columns);

/// Collective. Sets the lattice's laws, and whether the file gives them. Error (exit 2): unknown law.
PetscErrorCode read_laws(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& layout, Lattice* lattice);

/// Local. Warns of members of a lattice's groups that are none of the schema: a misspelt name of an optional dataset
/// would otherwise go unseen.
void note_unknown_members(const Hdf5File& file, Lattice* lattice);

}  // namespace bs
