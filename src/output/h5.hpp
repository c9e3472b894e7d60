// Attributes and groups of HDF5 files, and one form of error for HDF5's calls.
#pragma once
#include <hdf5.h>
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/h5_handle.hpp"

namespace bs {

#if defined(PETSC_USE_COMPLEX)
#error "the trajectory holds real numbers: build with a real PETSc"
#endif

/// HDF5's message on the last failed call: the innermost entry of its error stack.
std::string h5_reason();

/// A failed HDF5 call becomes a PETSc error with HDF5's own reason.
#define BS_H5(call)                                                                         \
  do {                                                                                      \
    if ((call) < 0) SETERRQ(PETSC_COMM_SELF, PETSC_ERR_LIB, "%s", bs::h5_reason().c_str()); \
  } while (0)

/// A group opened, or created with the groups above it. Collective, as is everything below.
PetscErrorCode open_group(hid_t file, const std::string& path, H5* group);

/// Whether a dataset or group is there.
bool h5_exists(hid_t file, const std::string& path);

/// Where in its file the header of an open object begins; negative if HDF5 cannot tell.
herr_t find_h5_header(hid_t object, haddr_t* at);

/// A text attribute of fixed length of an object in an open file; empty if there is none.
std::string fixed_text(hid_t file, const char* object, const char* name);

/// Attributes of an open object; an attribute must not exist yet.
PetscErrorCode put_attribute(hid_t object, const char* name, const std::vector<std::int32_t>& values);
PetscErrorCode put_attribute(hid_t object, const char* name, std::int64_t value);
PetscErrorCode put_attribute(hid_t object, const char* name, double value);
/// A string of variable length: readers treat those of fixed length as bytes.
PetscErrorCode put_attribute(hid_t object, const char* name, const std::string& value);
/// A string of fixed length, which takes no part of HDF5's global heap: there a damaged byte can keep a reader forever.
PetscErrorCode put_text(hid_t object, const char* name, const std::string& value);
/// `count` copies of `word`, as an array of strings of fixed length.
PetscErrorCode put_words(hid_t object, const char* name, const std::vector<std::string>& words);
/// A reference to the object at `path`.
PetscErrorCode put_reference(hid_t file, hid_t object, const char* name, const std::string& path);

/// PETSc's error handler during a write; back to the previous one when it goes out of scope. On several ranks a
/// failure is one of this rank alone (fail_here, Exit::io): the others may be waiting in a collective call that it will not reach.
class IoWatch {
 public:
  /// The sentence is BEFORE: REASON AFTER, e.g. "cannot write frame 3 to a.h5md" and ": earlier frames are intact".
  IoWatch(MPI_Comm comm, std::string before, std::string after);
  IoWatch(const IoWatch&) = delete;
  IoWatch& operator=(const IoWatch&) = delete;
  ~IoWatch();

  std::string sentence(const std::string& reason) const { return before_ + ": " + reason + after_; }
  /// Collective. Turns the code of the watched calls into 0 or ERR_FAILED.
  PetscErrorCode report(MPI_Comm comm, PetscErrorCode code) const;

 private:
  static PetscErrorCode handle(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type, const char* message, void* watch);
  MPI_Comm comm_;
  std::string before_, after_, reason_;
};

// A driver of HDF5 for files that one process writes: a plain file of which one range is written last, or first, in every flush.
//
// HDF5 writes the parts of a flush in the order of their places in the file. So the length of a dataset, in its header, is often written
// before the index of the chunk that its last rows are in: a process killed in between leaves rows that read as zeros. With the header of
// the clock written last, whoever trusts its length finds every row.

/// `access` (a file access list) opens files by this driver.
PetscErrorCode use_last_write(hid_t access);

enum class Order { first, last };

/// From now on the header of `object`, in `file`, which was opened by that driver, is written last in every flush; or first, which a
/// dataset that becomes shorter needs: HDF5 clears what is behind its new end.
PetscErrorCode write_header(hid_t file, hid_t object, Order order);

}  // namespace bs
