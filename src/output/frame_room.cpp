// Room for a frame, made before its first byte is written, so that neither a full disk nor a kill between two writes
// meets a file in pieces.
//
// HDF5 writes a file's parts in any order and the superblock, which tells where the file ends, last. A part that lies
// behind that end cannot be read, so a run killed in between would leave a file whose newest parts hide the older ones.
// Here everything a frame needs is allocated first, then an end behind all of it is stored, and only then anything is
// written.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "base/fault.hpp"
#include "output/frame_file.hpp"

namespace bs {

namespace {

constexpr std::int64_t index_bytes = 1 << 20;  // the indices of chunks may grow by; a hole, not disk
constexpr off_t version_at = 8, end_at = 40;   // of the superblock, version 0: HDF5 File Format Specification, II.A

/// Moves the end that the superblock tells `bytes` back, and the file's length with it; the next flush stores the true
/// ones again. errno of what failed, or 0. HDF5's own calls for this (H5Fget_eoa, H5Fincrement_filesize) refuse MPI-IO.
int move_end(const std::string& path, std::int64_t bytes) {
  unsigned char version = 1;
  std::uint64_t end = 0;
  struct stat status;
  const int handle = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (handle < 0) return errno;
  const auto fails = [handle] {
    const int reason = errno;
    close(handle);
    return reason;
  };
  if (fstat(handle, &status) != 0 || pread(handle, &version, 1, version_at) != 1) return fails();
  if (version == 0) {  // what HDF5 makes unless told otherwise; little-endian on every machine
    if (pread(handle, &end, sizeof end, end_at) != sizeof end) return fails();
    end += static_cast<std::uint64_t>(bytes);
    if (static_cast<std::uint64_t>(status.st_size) < end && ftruncate(handle, static_cast<off_t>(end)) != 0) return fails();
    if (pwrite(handle, &end, sizeof end, end_at) != sizeof end) return fails();
  }
  return close(handle) == 0 ? 0 : errno;
}

PetscErrorCode extend(hid_t set, std::int64_t frames) {
  hsize_t extent[H5S_MAX_RANK];

  PetscFunctionBegin;
  H5 space(H5Dget_space(set), H5Sclose);
  BS_H5(H5Sget_simple_extent_dims(space, extent, nullptr));
  extent[0] = static_cast<hsize_t>(frames);
  BS_H5(H5Dset_extent(set, extent));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode Trajectory::Impl::frame_bytes(const std::vector<Field>& fields, const std::vector<Observable>& given, std::int64_t* bytes) const {
  std::int64_t pending = static_cast<std::int64_t>(records.size()), width = 0;

  PetscFunctionBegin;
  // Metadata, and a new chunk of the small datasets at once.
  *bytes = 131072 + 96 * (pending + log_chunk);
  for (const Observable& observable : given) width += static_cast<std::int64_t>(observable.value.size());
  *bytes += std::int64_t{8} * frame_chunk * (width + columns + 2);
  for (const Field& field : fields) {
    PetscInt size, block;
    PetscCall(VecGetSize(field.vec, &size));
    PetscCall(VecGetBlockSize(field.vec, &block));
    *bytes += 8 * (size / block) * width_of(field.group, block);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::make_room(std::int64_t more, std::int64_t bytes) {
  std::int64_t pending = static_cast<std::int64_t>(records.size());

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&pending, 1, MPI_INT64_T, 0, comm));
  for (Column& column : log) PetscCall(column.extend(pending));
  for (Column& column : observables) PetscCall(column.extend(more));
  if (edges.id() >= 0) PetscCall(edges.extend(more));
  for (const H5& set : values) PetscCall(extend(set, frames + more));
  PetscCall(leave_room(bytes + index_bytes));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::leave_room(std::int64_t bytes) {
  int result = 0;

  PetscFunctionBegin;
  if (rank == 0 && published) result = move_end(target, bytes);
  PetscCallMPI(MPI_Bcast(&result, 1, MPI_INT, 0, comm));
  PetscCheck(result == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s", std::strerror(result));
  PetscFunctionReturn(0);
}

}  // namespace bs
