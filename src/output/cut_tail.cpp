// What a trajectory holds after the checkpoint it is continued from: taken away when something is to be written in its
// place, and kept in a file beside it until the first new frame is whole.
#include <fcntl.h>
#include <unistd.h>
#include <cstring>
#include <limits>
#include "base/error.hpp"
#include "output/frame_file.hpp"
#include "output/h5.hpp"

namespace bs {

namespace {

PetscErrorCode shorten(hid_t file, const std::string& path, std::int64_t rows) {
  hsize_t extent[H5S_MAX_RANK];
  PetscFunctionBegin;
  H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  H5 space(H5Dget_space(set), H5Sclose);
  BS_H5(H5Sget_simple_extent_dims(space, extent, nullptr));
  if (static_cast<std::int64_t>(extent[0]) <= rows) PetscFunctionReturn(0);
  extent[0] = static_cast<hsize_t>(rows);
  BS_H5(H5Dset_extent(set, extent));
  PetscFunctionReturn(0);
}

/// Rows [first, last) of one dataset into a new one of the same path. Returns false where they cannot be written.
bool copy_rows(hid_t from, hid_t to, const std::string& path, hsize_t first, hsize_t last) {
  hsize_t extent[H5S_MAX_RANK];
  const H5 set(H5Dopen2(from, path.c_str(), H5P_DEFAULT), H5Dclose);
  const H5 space(H5Dget_space(set), H5Sclose), type(H5Dget_type(set), H5Tclose);
  const int axes = H5Sget_simple_extent_dims(space, extent, nullptr);
  if (set < 0 || axes < 1) return true;
  extent[0] = last - first;
  const H5 wide(H5Screate_simple(axes, extent, nullptr), H5Sclose), groups(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  if (H5Pset_create_intermediate_group(groups, 1) < 0) return false;
  const H5 made(H5Dcreate2(to, path.c_str(), type, wide, groups, H5P_DEFAULT, H5P_DEFAULT), H5Dclose);
  if (made < 0) return false;
  std::size_t bytes = H5Tget_size(type);
  for (int k = 1; k < axes; ++k) bytes *= extent[k];
  std::vector<char> row(bytes);
  extent[0] = 1;
  const H5 memory(H5Screate_simple(axes, extent, nullptr), H5Sclose);
  hsize_t at[H5S_MAX_RANK] = {0};
  for (hsize_t k = first; k < last; ++k) {
    at[0] = k;
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, at, nullptr, extent, nullptr) < 0 ||
        H5Dread(set, type, memory, space, H5P_DEFAULT, row.data()) < 0)
      return true;  // half a frame of a killed run
    at[0] = k - first;
    if (H5Sselect_hyperslab(wide, H5S_SELECT_SET, at, nullptr, extent, nullptr) < 0 ||
        H5Dwrite(made, type, memory, wide, H5P_DEFAULT, row.data()) < 0)
      return false;
  }
  return true;
}

/// Copies what is behind the mark. False where it cannot be written.
bool copy_tail(hid_t from, hid_t to, const TrajectoryMark& mark) {
  std::string fault;
  const std::vector<Growing> sets = growing_of(from, mark, &fault);
  std::int64_t whole = std::numeric_limits<std::int64_t>::max(), rows = 0;
  for (const Growing& set : sets)
    if (set.clock && !count_rows(from, set.path, &rows)) whole = std::min(whole, rows);
  for (const Growing& set : sets) {
    if (count_rows(from, set.path, &rows)) return false;
    if (!set.log) rows = std::min(rows, whole);
    if (rows > set.rows && !copy_rows(from, to, set.path, static_cast<hsize_t>(set.rows), static_cast<hsize_t>(rows))) return false;
  }
  return H5Fflush(to, H5F_SCOPE_GLOBAL) >= 0;
}

/// Local. Copies what is in `trajectory` behind the mark to a new file beside it, whose name is returned. Rows that cannot be
/// read are left out. `reason`: why there is no such file, or nothing.
std::string keep_tail(const std::string& trajectory, const TrajectoryMark& mark, std::string* reason) {
  std::string name;
  int handle = -1;
  if (const int why = create_fresh(trajectory, ".tail", &name, &handle)) {
    *reason = std::strerror(why);
    return {};
  }
  bool good = false;
  {
    // the file that was just created, not whatever its name leads to by now
    const std::string place = "/proc/self/fd/" + std::to_string(handle);
    const H5 to(H5Fcreate(place.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    const H5 access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    (void)H5Pset_file_locking(access, 0, 1);  // as it is open for writing, too
    const H5 from(H5Fopen(trajectory.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
    good = to >= 0 && from >= 0 && copy_tail(from, to, mark);
    if (!good) *reason = h5_reason();
  }
  if (good && fsync(handle) != 0) *reason = std::strerror(errno);
  close(handle);
  if (reason->empty()) return name;
  (void)unlink(name.c_str());
  return {};
}

}  // namespace

/// The clock first, and written: whoever trusts its length then finds every row, also if the run ends here.
PetscErrorCode Trajectory::Impl::shorten_to_mark() {
  std::string outside;
  H5 clock;
  PetscFunctionBegin;
  const std::vector<Growing> sets = growing_of(file, mark, &outside);
  for (const Growing& set : sets)
    if (set.times() && !shared && clock < 0) clock = H5(H5Dopen2(file, set.path.c_str(), H5P_DEFAULT), H5Dclose);
  if (clock >= 0) PetscCall(write_header(file, clock, Order::first));
  for (const bool of_clock : {true, false}) {
    for (const Growing& set : sets)
      if (set.clock == of_clock) PetscCall(shorten(file, set.path, set.rows));
    BS_H5(H5Fflush(file, H5F_SCOPE_GLOBAL));
    if (clock >= 0) PetscCall(write_header(file, clock, Order::last));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::cut_tail() {
  Error fault;
  PetscFunctionBegin;
  if (!tail) PetscFunctionReturn(0);
  if (rank == 0) {
    std::string reason;
    kept = keep_tail(target, mark, &reason);
    if (!reason.empty())
      fault.note(0,
                 "cannot keep what " + options.file + " holds after the checkpoint until the next frame is written: " + reason +
                     ": the trajectory is as it was",
                 Exit::io);
  }
  PetscCall(fail_if_any(comm, fault));
  if (writer) PetscCall(shorten_to_mark());
  tail = false;
  PetscFunctionReturn(0);
}

PetscErrorCode Trajectory::Impl::drop_kept() {
  PetscFunctionBegin;
  if (!kept.empty()) (void)unlink(kept.c_str());
  kept.clear();
  PetscFunctionReturn(0);
}

}  // namespace bs
