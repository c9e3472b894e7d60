#include "output/frame_columns.hpp"
#include <algorithm>
#include <cstring>
#include <numeric>
#include "base/collective.hpp"
#include "base/vec_array.hpp"

namespace bs {

namespace {

constexpr hsize_t chunk_numbers = hsize_t(1) << 26;  // of a field; HDF5 takes less than 4 GB
constexpr hsize_t small_chunk = 1024;                // numbers that frames share a chunk up to
constexpr hsize_t most_frames = 128;                 // in a chunk

hsize_t frames_in_chunk(hsize_t numbers) { return std::clamp<hsize_t>(small_chunk / std::max<hsize_t>(1, numbers), 1, most_frames); }

}  // namespace

PetscErrorCode FieldColumn::describe(const Field& field, PetscInt columns) {
  PetscInt size, local;
  PetscFunctionBegin;
  group_ = field.group;
  flat_ = field.flat;
  whole_ = field.drawing;
  powers_ = field.powers;
  PetscCall(VecGetSize(field.vec, &size));
  PetscCall(VecGetLocalSize(field.vec, &local));
  PetscCall(VecGetBlockSize(field.vec, &block_));
  PetscCall(VecGetOwnershipRange(field.vec, &first_, nullptr));
  first_ /= block_;
  rows_ = local / block_;
  total_ = size / block_;
  width_ = group_.rfind("/particles/trajectory/", 0) == 0 ? std::max(block_, columns) : block_;
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::create(hid_t file, bool single) {
  const hsize_t rows = static_cast<hsize_t>(total_), width = static_cast<hsize_t>(width_), together = frames_in_chunk(rows * width);
  const hsize_t extent[3] = {1, rows, width}, none[3] = {0, rows, width}, most[3] = {H5S_UNLIMITED, rows, width};
  const hsize_t chunk[3] = {together, std::max<hsize_t>(1, std::min(rows, chunk_numbers / width)), width};
  const int axes = flat_ && width_ == 1 ? 2 : 3;
  PetscFunctionBegin;
  H5 space(H5Screate_simple(axes, extent, most), H5Sclose), list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  BS_H5(space);
  BS_H5(H5Pset_chunk(list, axes, chunk));
  BS_H5(H5Pset_alloc_time(list, H5D_ALLOC_TIME_EARLY));
  if (together == 1) BS_H5(H5Pset_fill_time(list, H5D_FILL_TIME_NEVER));
  const hid_t type = whole_ ? H5T_STD_I32LE : single ? H5T_IEEE_F32LE : H5T_IEEE_F64LE;
  set_ = H5(H5Dcreate2(file, (group_ + "/value").c_str(), type, space, H5P_DEFAULT, list, H5P_DEFAULT), H5Dclose);
  BS_H5(set_);
  if (together > 1) BS_H5(H5Dset_extent(set_, none));
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::open(hid_t file) {
  PetscFunctionBegin;
  set_ = H5(H5Dopen2(file, (group_ + "/value").c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set_);
  PetscFunctionReturn(0);
}

std::int64_t FieldColumn::bytes(std::int64_t frames) const {
  const std::int64_t numbers = std::int64_t{total_} * width_;
  const auto together = static_cast<std::int64_t>(frames_in_chunk(static_cast<hsize_t>(numbers)));
  return 8 * numbers * (frames + (frames > 0 ? together - 1 : 0)) + 32 * frames;
}

/// This rank's rows [first, first + count) of the field, with zeros appended.
PetscErrorCode FieldColumn::rows(const Field& field, PetscInt first, PetscInt count, double* to) const {
  PetscFunctionBegin;
  if (field.source) {
    PetscCall(field.source(first, count, to));
  } else {
    const ReadArray from(field.vec);
    std::copy(from + first * block_, from + (first + count) * block_, to);
  }
  if (block_ == width_) PetscFunctionReturn(0);
  for (PetscInt i = count; i-- > 0;) {  // from the last, each to its place
    std::memmove(to + i * width_, to + i * block_, sizeof(double) * static_cast<std::size_t>(block_));
    std::fill(to + i * width_ + block_, to + (i + 1) * width_, 0.0);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::hold(const Field& field, bool copy) {
  PetscFunctionBegin;
  if (!copy && (field.source || block_ == width_)) {
    later_ = field;
    PetscFunctionReturn(0);
  }
  const std::size_t old = waiting_.size();
  waiting_.resize(old + static_cast<std::size_t>(rows_ * width_));
  PetscCall(rows(field, 0, rows_, waiting_.data() + old));
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::gather(MPI_Comm comm, std::int64_t frames) {
  PetscFunctionBegin;
  PetscCheck(!later_.vec, comm, PETSC_ERR_PLIB, "a frame that was not copied cannot be gathered");
  const PetscMPIInt rank = rank_of(comm), ranks = size_of(comm);
  const int mine = static_cast<int>(waiting_.size());
  std::vector<int> counts(rank == 0 ? static_cast<std::size_t>(ranks) : 0), starts(counts.size());
  PetscCallMPI(MPI_Gather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, comm));
  std::partial_sum(counts.begin(), counts.end(), starts.begin());
  for (std::size_t k = 0; k < starts.size(); ++k) starts[k] -= counts[k];
  const std::size_t frame = static_cast<std::size_t>(total_) * static_cast<std::size_t>(width_);
  std::vector<double> arrived(rank == 0 ? frame * static_cast<std::size_t>(frames) : 0);
  PetscCallMPI(MPI_Gatherv(waiting_.data(), mine, MPI_DOUBLE, arrived.data(), counts.data(), starts.data(), MPI_DOUBLE, 0, comm));
  all_.resize(arrived.size());
  std::size_t place = 0;  // of the rank's rows in a frame
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const std::size_t share = static_cast<std::size_t>(counts[k]) / static_cast<std::size_t>(frames);
    const double* from = arrived.data() + starts[k];
    for (std::size_t f = 0; f < static_cast<std::size_t>(frames); ++f) std::copy_n(from + f * share, share, all_.data() + f * frame + place);
    place += share;
  }
  gathered_ = true;
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::extend(std::int64_t frames) {
  hsize_t extent[H5S_MAX_RANK];
  PetscFunctionBegin;
  if (left_out_) PetscFunctionReturn(0);
  H5 space(H5Dget_space(set_), H5Sclose);
  BS_H5(H5Sget_simple_extent_dims(space, extent, nullptr));
  extent[0] = static_cast<hsize_t>(frames);
  BS_H5(H5Dset_extent(set_, extent));
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::write_rows(const hsize_t* start, const hsize_t* size, hid_t transfer, const double* data) const {
  PetscFunctionBegin;
  if (left_out_) PetscFunctionReturn(0);
  H5 space(H5Dget_space(set_), H5Sclose);
  const int axes = H5Sget_simple_extent_ndims(space);
  H5 memory(H5Screate_simple(axes, size, nullptr), H5Sclose);
  BS_H5(memory);
  if (size[1] > 0) {
    BS_H5(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, size, nullptr));
  } else {  // a rank without rows takes part all the same
    BS_H5(H5Sselect_none(space));
    BS_H5(H5Sselect_none(memory));
  }
  BS_H5(H5Dwrite(set_, H5T_NATIVE_DOUBLE, memory, space, transfer, data));
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::write_piece(std::int64_t at, PetscInt first, PetscInt count, hid_t transfer) {
  const PetscInt rows_left = std::min(count, rows_ - first);
  const hsize_t start[3] = {static_cast<hsize_t>(at), static_cast<hsize_t>(first_ + first), 0};
  const hsize_t size[3] = {1, static_cast<hsize_t>(rows_left), static_cast<hsize_t>(width_)};
  PetscFunctionBegin;
  if (rows_left <= 0) PetscFunctionReturn(0);
  piece_.resize(static_cast<std::size_t>(count * width_));
  PetscCall(rows(later_, first, rows_left, piece_.data()));
  PetscCall(write_rows(start, size, transfer, piece_.data()));
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::write(std::int64_t at, std::int64_t first, std::int64_t count, hid_t transfer) {
  const hsize_t rows = static_cast<hsize_t>(gathered_ ? total_ : rows_), width = static_cast<hsize_t>(width_);
  const hsize_t start[3] = {static_cast<hsize_t>(at), static_cast<hsize_t>(gathered_ ? 0 : first_), 0};
  const hsize_t size[3] = {static_cast<hsize_t>(count), rows, width};
  const PetscScalar* data = gathered_ ? all_.data() : waiting_.data();
  PetscFunctionBegin;
  if (later_.vec) PetscCall(VecGetArrayRead(later_.vec, &data));
  else data += static_cast<std::size_t>(first) * rows * width;
  PetscCall(write_rows(start, size, transfer, data));
  if (later_.vec) PetscCall(VecRestoreArrayRead(later_.vec, &data));
  PetscFunctionReturn(0);
}

PetscErrorCode FieldColumn::done(std::int64_t count) {
  PetscFunctionBegin;
  later_ = {};
  gathered_ = false;
  all_.clear();
  const auto written = std::min<std::size_t>(waiting_.size(), static_cast<std::size_t>(count) * static_cast<std::size_t>(rows_ * width_));
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(written));
  PetscFunctionReturn(0);
}

}  // namespace bs
