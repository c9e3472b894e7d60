// HDF5 files that are written at once, by all ranks: a checkpoint, a lattice.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <functional>
#include <string>
#include "output/h5.hpp"

namespace bs {

/// Collective. A new file beside `target` of some `bytes`, which `fill` writes on all ranks; `made` is its name, empty where none was made, for
/// give_name() or unlink() on rank 0. `reason`: why the system does not let it be written, or nothing.
PetscErrorCode write_whole_hdf5(MPI_Comm comm, const std::string& target, std::int64_t bytes, const std::function<PetscErrorCode(hid_t)>& fill,
                                std::string* made, std::string* reason);

}  // namespace bs
