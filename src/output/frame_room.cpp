// Room for frames, made before their first byte is written, so that neither a full disk nor a kill between two writes
// meets a file in pieces.
//
// HDF5 writes a file's parts in any order and the superblock, which tells where the file ends, last. A part that lies
// behind that end cannot be read, so a run killed in between would leave a file whose newest parts hide the older ones.
// Here everything that frames need is allocated first, then an end behind all of it is stored, and only then anything is
// written.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <iterator>

#include "base/error.hpp"
#include "output/frame_file.hpp"
#include "output/space.hpp"

namespace bs {

namespace {

constexpr std::int64_t spare_bytes = 1 << 16;  // of metadata that may still be allocated; a hole, not disk
constexpr off_t version_at = 8, end_at = 40;   // of the superblock, version 0: HDF5 File Format Specification, II.A

struct Handle {
  int number;
  ~Handle() {
    if (number >= 0) (void)::close(number);
  }
};

/// The end that the superblock tells, or 0 of one that is not HDF5's usual one. errno of what failed, or 0.
int stored_end(int handle, std::uint64_t* end) {
  unsigned char version = 1;
  *end = 0;
  if (pread(handle, &version, 1, version_at) != 1) return errno ? errno : EIO;
  if (version != 0) return 0;  // version 0 is what HDF5 makes unless told otherwise; little-endian on every machine
  return pread(handle, end, sizeof *end, end_at) == sizeof *end ? 0 : EIO;
}

/// Lets the superblock tell an end of at least `least`, and the file's length reach there; the next flush that allocates stores the
/// true one again. errno of what failed, or 0. HDF5's own calls for this (H5Fget_eoa, H5Fincrement_filesize) refuse MPI-IO.
int move_end(const std::string& path, std::uint64_t least) {
  std::uint64_t end = 0;
  struct stat status;
  const Handle handle{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
  if (handle.number < 0 || fstat(handle.number, &status) != 0) return errno;
  if (const int why = stored_end(handle.number, &end)) return why;
  if (end == 0 || end >= least) return 0;
  if (static_cast<std::uint64_t>(status.st_size) < least && ftruncate(handle.number, static_cast<off_t>(least)) != 0) return errno;
  return pwrite(handle.number, &least, sizeof least, end_at) == sizeof least ? 0 : errno;
}

}  // namespace

int store_end(const std::string& path, std::int64_t end) {
  std::uint64_t stored = 0;
  const auto exact = static_cast<std::uint64_t>(end);
  const Handle handle{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
  if (handle.number < 0) return errno;
  if (const int why = stored_end(handle.number, &stored)) return why;
  if (stored == 0 || stored == exact) return 0;
  return pwrite(handle.number, &exact, sizeof exact, end_at) == sizeof exact ? 0 : errno;
}

int cut_behind_end(const std::string& path) {
  std::uint64_t end = 0;
  const Handle handle{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
  if (handle.number < 0) return errno;
  if (const int why = stored_end(handle.number, &end)) return why;
  return end == 0 || ftruncate(handle.number, static_cast<off_t>(end)) == 0 ? 0 : errno;
}

std::int64_t Trajectory::Impl::allocated() const {
  hsize_t size = 0;
  return H5Fget_filesize(file, &size) < 0 ? 0 : static_cast<std::int64_t>(size);
}

std::int64_t Trajectory::Impl::frame_bytes(std::int64_t count, std::int64_t rows) const {
  std::int64_t width = columns + 2, bytes = 0;
  const auto held = [](std::int64_t more) { return more > 0 ? more + column_chunk : 0; };
  for (const ObservableColumn& o : observables) width += o.width;
  bytes += std::int64_t{8} * width * held(count);
  bytes += std::int64_t{8} * static_cast<std::int64_t>(std::size(STEP_COLUMNS) + std::size(REJECTION_REASONS)) * held(rows);
  for (const FieldColumn& field : fields) bytes += field.bytes(count);
  return bytes;
}

/// Room on disk for that; what is then allocated and written is within it.
PetscErrorCode Trajectory::Impl::reserve(std::int64_t count, std::int64_t rows, std::string* full) {
  const std::int64_t bytes = frame_bytes(count, rows) + (laid_out ? spare_bytes : 4 * spare_bytes);

  PetscFunctionBegin;
  const std::int64_t begin = holds() ? allocated() : 0;
  room_end = begin + bytes;
  PetscCall(reserve_space(comm, path(), begin, bytes, full));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::make_room(std::int64_t count, std::int64_t rows) {
  PetscFunctionBegin;
  for (Column& column : log) PetscCall(column.extend(rows));
  if (count > 0) {
    for (ObservableColumn& o : observables)
      if (!o.left_out) PetscCall(o.column.extend(count));
    if (edges.id() >= 0) PetscCall(edges.extend(count));
    for (FieldColumn& field : fields) PetscCall(field.extend(frames + count));
  }
  PetscCall(leave_room(room_end));
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::leave_room(std::int64_t end) {
  int result = 0;

  PetscFunctionBegin;
  if (!published) PetscFunctionReturn(0);
  if (rank == 0) result = move_end(target, static_cast<std::uint64_t>(std::max(end, allocated() + spare_bytes)));
  PetscCallMPI(MPI_Bcast(&result, 1, MPI_INT, 0, io));
  PetscCheck(result == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s", std::strerror(result));
  PetscFunctionReturn(0);
}

}  // namespace bs
