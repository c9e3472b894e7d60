// The periodic box of a lattice: read from a file, and the box that the second end of each spring is in.
#pragma once
#include <petscsys.h>

#include "input/hdf5_file.hpp"
#include "input/hdf5_layout.hpp"
#include "lattice/lattice.hpp"

namespace bs {

/// Collective. /box (attribute boundary, dataset edges) and /springs/shift into the lattice, whose rows of springs are known; of a trajectory its box
/// at the last frame and /connectivity/bonds_shift. Errors (exit 2): words other than periodic and none, edges of the wrong shape or without volume,
/// shifts beyond 63 or across what is not periodic.
PetscErrorCode read_hdf5_box(MPI_Comm comm, const Hdf5File& file, const Hdf5Layout& names, Lattice* lattice);

/// Collective. Where the lattice has a periodic box and no shifts, each spring joins the nearest images of its ends. Error (exit 2): two images are
/// equally near. Springs joining a particle to itself need a shift. The same of interactions, whose ends are the images nearest to one of them.
PetscErrorCode settle_shifts(MPI_Comm comm, Lattice* lattice);

}  // namespace bs
