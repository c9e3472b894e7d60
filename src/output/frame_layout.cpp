// The datasets of a trajectory, made once with no rows.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <iterator>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "output/frame_file.hpp"
#include "output/fresh_file.hpp"

namespace bs {

namespace {

/// While it lives, datasets get the chunk index of HDF5 1.10 (an extensible array): it grows at its end, where the older
/// B-tree moves entries of finished frames from node to node, and a run killed between two nodes' writes would lose them.
class ModernDatasets {
 public:
  explicit ModernDatasets(hid_t file) : file_(file) { (void)H5Fset_libver_bounds(file, H5F_LIBVER_V110, H5F_LIBVER_LATEST); }
  ModernDatasets(const ModernDatasets&) = delete;
  ModernDatasets& operator=(const ModernDatasets&) = delete;
  ~ModernDatasets() { (void)H5Fset_libver_bounds(file_, H5F_LIBVER_EARLIEST, H5F_LIBVER_LATEST); }

 private:
  hid_t file_;
};

}  // namespace

PetscErrorCode Trajectory::Impl::put_unit(const std::string& dataset, const std::string& quantity, const Powers& powers) {
  std::string unit = unit_of(powers, options.units);
  PetscFunctionBegin;
  if (unit.empty()) unit = unit_of_quantity(quantity, options.units);
  if (unit.empty()) PetscFunctionReturn(0);
  H5 set(H5Dopen2(file, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  PetscCall(put_attribute(set, "unit", unit));
  PetscFunctionReturn(0);
}

std::vector<std::string> log_columns() {
  std::vector<std::string> names(std::begin(STEP_COLUMNS), std::end(STEP_COLUMNS));
  for (const RejectionReason& reason : REJECTION_REASONS) names.push_back(std::string("rejected_") + reason.key);
  return names;
}

PetscErrorCode Trajectory::Impl::create_log() {
  H5 group;
  PetscFunctionBegin;
  PetscCall(open_group(file, "/backspring/log", &group));
  const ModernDatasets modern(file);
  for (const std::string& name : log_columns()) {
    const bool real = name == "time" || name == "dt";
    log.emplace_back();
    PetscCall(log.back().create(io, file, "/backspring/log/" + name, !real, 0, column_chunk));
    if (real && options.units != OutputUnits::none) PetscCall(put_attribute(log.back().id(), "unit", unit_of_quantity("time", options.units)));
  }
  PetscFunctionReturn(0);
}

/// GROUP/step and GROUP/time: made in the first group, hard links to those in the others.
PetscErrorCode Trajectory::Impl::link_clock(const std::string& group) {
  H5 owner;
  PetscFunctionBegin;
  PetscCall(open_group(file, group, &owner));
  if (step.id() < 0) {
    const int chunk = shared ? shared_clock_chunk : column_chunk;
    PetscCall(step.create(io, file, group + "/step", true, 0, chunk));
    PetscCall(time.create(io, file, group + "/time", false, 0, chunk));
    if (options.units != OutputUnits::none) PetscCall(put_attribute(time.id(), "unit", unit_of_quantity("time", options.units)));
  } else {
    BS_H5(H5Lcreate_hard(step.id(), ".", owner, "step", H5P_DEFAULT, H5P_DEFAULT));
    BS_H5(H5Lcreate_hard(time.id(), ".", owner, "time", H5P_DEFAULT, H5P_DEFAULT));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::lay_out() {
  PetscFunctionBegin;
  const ModernDatasets modern(file);
  for (FieldColumn& field : fields) {
    PetscCall(link_clock(field.group()));
    PetscCall(field.create(file, single));
    PetscCall(put_unit(field.group() + "/value", field.group().substr(field.group().rfind('/') + 1), field.powers()));
  }
  for (ObservableColumn& o : observables) {
    const std::string group = o.group();
    PetscCall(link_clock(group));
    PetscCall(o.column.create(io, file, group + "/value", false, o.width == 1 && o.columns == 0 && o.name != BOX_EDGES ? 0 : o.width, column_chunk,
                              o.columns));
    PetscCall(put_unit(group + "/value", o.name, o.powers));
  }
  if (columns > 0 && !fields.empty() && options.boundary.empty()) {
    const std::string group = BOX_EDGES;
    PetscCall(link_clock(group));
    PetscCall(edges.create(io, file, group + "/value", false, columns, column_chunk));
    PetscCall(put_unit(group + "/value", group, {}));
  }
  PetscFunctionReturn(0);
}

// Room for frames, made before their first byte is written, so that neither a full disk nor a kill between two writes
// meets a file in pieces.
//
// HDF5 writes a file's parts in any order and the superblock, which tells where the file ends, last. A part that lies
// behind that end cannot be read, so a run killed in between would leave a file whose newest parts hide the older ones.
// Here everything that frames need is allocated first, then an end behind all of it is stored, and only then anything is
// written.

namespace {

constexpr std::int64_t spare_bytes = 1 << 16;  // room for metadata that may still be allocated; a hole in the file, which takes no disk
constexpr off_t version_at = 8, end_at = 40;   // of the superblock, version 0: HDF5 File Format Specification, II.A

struct Handle {
  int number;
  ~Handle() {
    if (number >= 0) (void)::close(number);
  }
};

/// Reads the end of the file that the superblock holds, or 0 where the superblock is not of version 0. Returns 0, or errno of the call that failed.
int stored_end(int handle, std::uint64_t* end) {
  unsigned char version = 1;
  *end = 0;
  if (pread(handle, &version, 1, version_at) != 1) return errno ? errno : EIO;
  if (version != 0) return 0;  // version 0 is what HDF5 makes unless told otherwise; little-endian on every machine
  return pread(handle, end, sizeof *end, end_at) == sizeof *end ? 0 : EIO;
}

/// Raises the end of the file in the superblock, and the length of the file, to at least `least`; the next flush that allocates stores the true end
/// again. Returns 0, or errno of the call that failed. HDF5's own calls for this (H5Fget_eoa, H5Fincrement_filesize) refuse MPI-IO.
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

/// Reserves the room on disk; what is then allocated and written lies within it.
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
  for (GrowingColumn& column : log) PetscCall(column.extend(rows));
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
  PetscFunctionBegin;
  if (!published) PetscFunctionReturn(0);
  const int result = ask_rank_0(io, [&] { return move_end(target, static_cast<std::uint64_t>(std::max(end, allocated() + spare_bytes))); });
  PetscCheck(result == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s", std::strerror(result));
  PetscFunctionReturn(0);
}

}  // namespace bs
