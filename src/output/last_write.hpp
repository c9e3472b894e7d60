// A driver of HDF5 for files that one process writes: a plain file of which one range is written last, or first, in every flush.
//
// HDF5 writes the parts of a flush in the order of their places in the file. So the length of a dataset, in its header, is often written
// before the index of the chunk that its last rows are in: a process killed in between leaves rows that read as zeros. With the header of
// the clock written last, whoever trusts its length finds every row.
#pragma once
#include <hdf5.h>
#include <petscsys.h>

namespace bs {

/// `access` (a file access list) opens files by this driver.
PetscErrorCode use_last_write(hid_t access);

enum class Order { first, last };

/// From now on the header of `object`, in `file`, which was opened by that driver, is written last in every flush; or first, which a
/// dataset that becomes shorter needs: HDF5 clears what is behind its new end.
PetscErrorCode write_header(hid_t file, hid_t object, Order order);

}  // namespace bs
