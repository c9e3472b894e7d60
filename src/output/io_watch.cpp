#include "output/io_watch.hpp"

#include <cstring>

#include "base/fault.hpp"
#include "base/memory_room.hpp"
#include "output/h5.hpp"

namespace bs {

IoWatch::IoWatch(std::string before, std::string after) : before_(std::move(before)), after_(std::move(after)) {
  (void)PetscPushErrorHandler(handle, this);
}

IoWatch::~IoWatch() { (void)PetscPopErrorHandler(); }

PetscErrorCode IoWatch::handle(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type, const char* message, void* watch) {
  auto* self = static_cast<IoWatch*>(watch);
  PetscMPIInt size = 1;
  if (code == ERR_TOLD || type != PETSC_ERROR_INITIAL || !self->reason_.empty()) return code;
  const bool bare = !message || std::strstr(message, "Error in HDF5 call");
  self->reason_ = bare ? h5_reason() : std::string(message, std::strcspn(message, "\n"));
  self->reason_ += if_out_of_memory();
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return size > 1 ? tell_alone(Exit::io, self->sentence(self->reason_)) : code;
}

PetscErrorCode IoWatch::settle(MPI_Comm comm, PetscErrorCode code) const {
  if (code == 0 || code == ERR_TOLD) return code;
  return tell(comm, Exit::io, sentence(reason_.empty() ? "unknown error" : reason_));
}

}  // namespace bs
