// The tables of a lattice in an HDF5 file, of a trajectory or of a lattice file: where the readers of input/ look for them.
#pragma once
#include <string>
#include <utility>
#include <vector>
#include "input/hdf5_layout.hpp"
#include "lattice/lattice.hpp"
#include "systems/system.hpp"

namespace bs {

/// Collective. All that the lattice holds and a file of the layout `names` keeps once, moved out of it; the same datasets on every rank. A lattice
/// file keeps places, velocities, histories of springs, what is broken and the box, too, which are frames of a trajectory.
PetscErrorCode take_tables(MPI_Comm comm, const Hdf5Layout& names, Lattice* lattice, std::vector<Dataset>* out);

/// What a lattice file says of the lattice in attributes of /, by name.
std::vector<std::pair<std::string, std::string>> root_attributes(const Lattice& lattice);

}  // namespace bs
