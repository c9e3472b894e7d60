// While a file is being written, a failure of HDF5, MPI-IO or PETSc becomes one sentence about that file.
#pragma once
#include <petscsys.h>

#include <string>

namespace bs {

/// PETSc's error handler during a write; back to the previous one when it goes out of scope. On several ranks a
/// failure ends the program (exit 4): the others may be waiting in a collective call that this rank will not reach.
class IoWatch {
 public:
  /// The sentence is BEFORE: REASON AFTER, e.g. "cannot write frame 3 to a.h5md" and ": earlier frames are intact".
  IoWatch(std::string before, std::string after);
  IoWatch(const IoWatch&) = delete;
  IoWatch& operator=(const IoWatch&) = delete;
  ~IoWatch();

  std::string sentence(const std::string& reason) const { return before_ + ": " + reason + after_; }
  /// Collective. Turns the code of the watched calls into 0 or ERR_TOLD.
  PetscErrorCode settle(MPI_Comm comm, PetscErrorCode code) const;

 private:
  static PetscErrorCode handle(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type, const char* message, void* watch);
  std::string before_, after_, reason_;
};

}  // namespace bs
