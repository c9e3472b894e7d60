#include "output/tables.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/vec_array.hpp"

namespace bs {

void GrowingColumn::set_shape(int width, int columns) {
  width_ = width;
  rank_ = width == 0 ? 1 : columns == 0 ? 2 : 3;
  shape_[1] = static_cast<hsize_t>(columns > 0 ? width / columns : width);
  shape_[2] = static_cast<hsize_t>(columns);
}

PetscErrorCode GrowingColumn::create(MPI_Comm comm, hid_t file, const std::string& path, bool integer, int width, int chunk, int columns) {
  PetscFunctionBegin;
  set_shape(width, columns);
  const hsize_t one[3] = {1, shape_[1], shape_[2]}, none[3] = {0, shape_[1], shape_[2]}, most[3] = {H5S_UNLIMITED, shape_[1], shape_[2]};
  const hsize_t piece[3] = {static_cast<hsize_t>(chunk), shape_[1], shape_[2]};
  const PetscMPIInt me = rank_of(comm);
  writer_ = me == 0;
  integer_ = integer;
  H5 space(H5Screate_simple(rank_, one, most), H5Sclose);
  BS_H5(space);
  H5 list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  BS_H5(H5Pset_chunk(list, rank_, piece));
  BS_H5(H5Pset_alloc_time(list, H5D_ALLOC_TIME_EARLY));  // before the first byte is written: see frame_room.cpp
  const hid_t type = integer ? H5T_STD_I64LE : H5T_IEEE_F64LE;
  set_ = H5(H5Dcreate2(file, path.c_str(), type, space, H5P_DEFAULT, list, H5P_DEFAULT), H5Dclose);
  BS_H5(set_);
  BS_H5(H5Dset_extent(set_, none));  // the index of its chunks is made with the first row: now, not while others read
  PetscFunctionReturn(0);
}

PetscErrorCode GrowingColumn::open(MPI_Comm comm, hid_t file, const std::string& path, std::int64_t rows) {
  hsize_t extent[3] = {0, 0, 0};
  PetscFunctionBegin;
  const PetscMPIInt me = rank_of(comm);
  writer_ = me == 0;
  set_ = H5(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set_);
  H5 space(H5Dget_space(set_), H5Sclose), type(H5Dget_type(set_), H5Tclose);
  const int rank = H5Sget_simple_extent_ndims(space);
  PetscCheck(rank >= 1 && rank <= 3, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s is not a column", path.c_str());
  BS_H5(H5Sget_simple_extent_dims(space, extent, nullptr));
  integer_ = H5Tget_class(type) == H5T_INTEGER;
  set_shape(rank == 1 ? 0 : static_cast<int>(rank == 2 ? extent[1] : extent[1] * extent[2]), rank == 3 ? static_cast<int>(extent[2]) : 0);
  rows_ = static_cast<hsize_t>(rows);
  PetscFunctionReturn(0);
}

PetscErrorCode GrowingColumn::extend(std::int64_t count) {
  const hsize_t extent[3] = {rows_ + static_cast<hsize_t>(count), shape_[1], shape_[2]};
  PetscFunctionBegin;
  if (count > 0) BS_H5(H5Dset_extent(set_, extent));
  PetscFunctionReturn(0);
}

PetscErrorCode GrowingColumn::append(std::int64_t count, const void* data) {
  const hsize_t more = static_cast<hsize_t>(count);
  const hsize_t start[3] = {rows_, 0, 0}, size[3] = {more, shape_[1], shape_[2]};
  PetscFunctionBegin;
  if (count == 0) PetscFunctionReturn(0);
  PetscCall(extend(count));
  rows_ += more;
  // Independent transfer: the other ranks have nothing to write.
  if (!writer_) PetscFunctionReturn(0);
  H5 file_space(H5Dget_space(set_), H5Sclose);
  BS_H5(H5Sselect_hyperslab(file_space, H5S_SELECT_SET, start, nullptr, size, nullptr));
  H5 memory(H5Screate_simple(rank_, size, nullptr), H5Sclose);
  BS_H5(H5Dwrite(set_, integer_ ? H5T_NATIVE_INT64 : H5T_NATIVE_DOUBLE, memory, file_space, H5P_DEFAULT, data));
  PetscFunctionReturn(0);
}

/// Writes this rank's rows in slices: MPI-IO counts bytes in 32 bits.
static PetscErrorCode write_slices(hid_t set, hid_t type, const Dataset& table, const char* data, hsize_t rows) {
  constexpr hsize_t slice_bytes = hsize_t(1) << 28;
  const hsize_t columns = table.columns > 0 ? static_cast<hsize_t>(table.columns) : 1;
  const hsize_t row_bytes = H5Tget_size(type) * columns, slice = std::max<hsize_t>(1, slice_bytes / row_bytes);
  const int rank = table.columns > 0 ? 2 : 1;
  PetscFunctionBegin;
  H5 space(H5Dget_space(set), H5Sclose);
  for (hsize_t done = 0; done < rows; done += slice) {
    const hsize_t start[2] = {static_cast<hsize_t>(table.first) + done, 0};
    const hsize_t size[2] = {std::min(slice, rows - done), columns};
    H5 memory(H5Screate_simple(rank, size, nullptr), H5Sclose);
    BS_H5(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, size, nullptr));
    BS_H5(H5Dwrite(set, type, memory, space, H5P_DEFAULT, data + done * row_bytes));
  }
  PetscFunctionReturn(0);
}

namespace {

/// The table's entries as bytes, their types in memory and in the file.
struct Content {
  const char* data;
  std::size_t entries;
  H5 text;  ///< owns the type of strings
  hid_t memory, file;

  explicit Content(const Dataset& table) {
    if (const Words* words = std::get_if<Words>(&table.rows)) {
      data = words->text.data();
      entries = words->text.size() / words->width;
      text = H5(H5Tcopy(H5T_C_S1), H5Tclose);
      H5Tset_size(text, words->width);
      memory = file = text;
    } else if (const auto* whole = std::get_if<std::vector<std::int64_t>>(&table.rows)) {
      set_numbers(*whole, H5T_NATIVE_INT64, H5T_STD_I64LE);
    } else {
      set_numbers(std::get<std::vector<double>>(table.rows), H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE);
    }
  }
  template <class Rows>
  void set_numbers(const Rows& rows, hid_t in_memory, hid_t in_file) {
    data = reinterpret_cast<const char*>(rows.data());
    entries = rows.size();
    memory = in_memory;
    file = in_file;
  }
};

}  // namespace

PetscErrorCode gather_table(MPI_Comm comm, Dataset* table) {
  PetscFunctionBegin;
  if (Words* words = std::get_if<Words>(&table->rows)) PetscCall(gather_on_rank_0(comm, words->text, &words->text));
  else if (auto* whole = std::get_if<std::vector<std::int64_t>>(&table->rows)) PetscCall(gather_on_rank_0(comm, *whole, whole));
  else if (auto* numbers = std::get_if<std::vector<double>>(&table->rows)) PetscCall(gather_on_rank_0(comm, *numbers, numbers));
  table->first = 0;
  PetscFunctionReturn(0);
}

PetscErrorCode write_table(hid_t file, const Dataset& table) {
  const Content content(table);
  const hsize_t extent[2] = {static_cast<hsize_t>(table.total), static_cast<hsize_t>(table.columns)};
  const hsize_t rows = content.entries / static_cast<std::size_t>(std::max(1, table.columns));
  PetscFunctionBegin;
  PetscCheck(table.path.size() > 1 && table.path[0] == '/', PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "dataset path %s is not absolute",
             table.path.c_str());
  PetscCheck(table.first + static_cast<std::int64_t>(rows) <= table.total, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ, "%s: more rows than the table has",
             table.path.c_str());
  const auto slash = table.path.rfind('/');
  if (slash > 0) {
    H5 group;
    PetscCall(open_group(file, table.path.substr(0, slash), &group));
  }
  H5 space(H5Screate_simple(table.columns > 0 ? 2 : 1, extent, nullptr), H5Sclose);
  H5 list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  BS_H5(H5Pset_fill_time(list, H5D_FILL_TIME_NEVER));  // every row is written by some rank
  H5 set(H5Dcreate2(file, table.path.c_str(), content.file, space, H5P_DEFAULT, list, H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  PetscCall(write_slices(set, content.memory, table, content.data, rows));
  PetscFunctionReturn(0);
}

std::int64_t table_bytes(const std::vector<Dataset>& tables) {
  std::int64_t bytes = 262144;
  for (const Dataset& table : tables) bytes += 8 * table.total * (table.columns > 0 ? table.columns : 1);
  return bytes;
}

PetscErrorCode refill_table(hid_t file, const Dataset& table) {
  const Content content(table);
  PetscFunctionBegin;
  H5 set(H5Dopen2(file, table.path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  PetscCall(write_slices(set, content.memory, table, content.data, content.entries / static_cast<std::size_t>(std::max(1, table.columns))));
  PetscFunctionReturn(0);
}

PetscErrorCode create_pages(hid_t file, const std::string& path, std::int64_t count, std::int64_t rows, std::int64_t columns, H5* set) {
  const hsize_t extent[3] = {static_cast<hsize_t>(count), static_cast<hsize_t>(rows), static_cast<hsize_t>(columns)};
  H5 group;
  PetscFunctionBegin;
  PetscCall(open_group(file, path.substr(0, path.rfind('/')), &group));
  H5 space(H5Screate_simple(3, extent, nullptr), H5Sclose), list(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  BS_H5(H5Pset_fill_time(list, H5D_FILL_TIME_NEVER));
  *set = H5(H5Dcreate2(file, path.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, list, H5P_DEFAULT), H5Dclose);
  BS_H5(*set);
  PetscFunctionReturn(0);
}

PetscErrorCode write_page(hid_t set, std::int64_t k, Vec vec) {
  constexpr hsize_t slice_numbers = hsize_t(1) << 25;  // MPI-IO counts bytes in 32 bits
  PetscInt block = 1, first = 0, n = 0;
  PetscFunctionBegin;
  PetscCall(VecGetBlockSize(vec, &block));
  PetscCall(VecGetOwnershipRange(vec, &first, nullptr));
  PetscCall(VecGetLocalSize(vec, &n));
  const ReadArray a(vec);
  H5 space(H5Dget_space(set), H5Sclose);
  const hsize_t columns = static_cast<hsize_t>(block), rows = static_cast<hsize_t>(n) / columns, slice = slice_numbers / columns;
  for (hsize_t done = 0; done < rows; done += slice) {
    const hsize_t start[3] = {static_cast<hsize_t>(k), static_cast<hsize_t>(first) / columns + done, 0};
    const hsize_t size[3] = {1, std::min(slice, rows - done), columns};
    H5 memory(H5Screate_simple(3, size, nullptr), H5Sclose);
    BS_H5(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, size, nullptr));
    BS_H5(H5Dwrite(set, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, a + done * columns));
  }
  PetscFunctionReturn(0);
}

namespace {

/// Place of the first of `count` numbers that is not finite; `count`: all are.
PetscInt first_not_finite(const double* values, PetscInt count) {
  // a sum of zeros is finite only if its factors are: no branch in the loop
  double sum = 0;
  for (PetscInt i = 0; i < count; ++i) sum += 0.0 * values[i];
  if (std::isfinite(sum)) return count;
  return static_cast<PetscInt>(std::find_if_not(values, values + count, [](double value) { return std::isfinite(value); }) - values);
}

const char* in_words(double value) { return std::isnan(value) ? "not a number" : "infinite"; }

void note(const std::string& name, std::int64_t row, double value, Error* fault) {
  fault->note(row, format("%s is %s in row %lld", name.c_str(), in_words(value), static_cast<long long>(row)), Exit::solve);
}

/// Of this rank's rows. `gaps`: NaN may stand there.
PetscErrorCode check_vector(const std::string& name, Vec vec, bool gaps, Error* fault) {
  PetscInt n, first, block;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(vec, &n));
  PetscCall(VecGetBlockSize(vec, &block));
  PetscCall(VecGetOwnershipRange(vec, &first, nullptr));
  const ReadArray values(vec);
  PetscInt at = first_not_finite(values, n);
  if (gaps) at = static_cast<PetscInt>(std::find_if(values + at, values + n, [](double value) { return std::isinf(value); }) - values);
  if (at < n) note(name, (first + at) / block, values[at], fault);
  PetscFunctionReturn(0);
}

/// Of a field whose rows come from a source, piece by piece.
PetscErrorCode check_rows(const Field& field, Error* fault) {
  constexpr PetscInt piece = 20000;  // rows, which stay in the processor's cache
  PetscInt n, first, block;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(field.vec, &n));
  PetscCall(VecGetBlockSize(field.vec, &block));
  PetscCall(VecGetOwnershipRange(field.vec, &first, nullptr));
  std::vector<double> rows(static_cast<std::size_t>(std::min(piece, n / block) * block));
  for (PetscInt row = 0; row < n / block; row += piece) {
    const PetscInt count = std::min(piece, n / block - row);
    PetscCall(field.source(row, count, rows.data()));
    const PetscInt at = first_not_finite(rows.data(), count * block);
    if (at < count * block) note(field.group, first / block + row + at / block, rows[static_cast<std::size_t>(at)], fault);
  }
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode find_not_finite(MPI_Comm comm, const std::vector<Field>& fields, const std::vector<Observable>& observables, std::string* what) {
  Error fault;
  PetscFunctionBegin;
  for (const Field& field : fields) {
    if (field.source) PetscCall(check_rows(field, &fault));
    else PetscCall(check_vector(field.group, field.vec, field.gaps, &fault));
  }
  PetscCall(first_error(comm, fault, what));
  for (const Observable& o : observables)  // the same on every rank
    for (const double value : o.value)
      if (what->empty() && !std::isfinite(value)) *what = format("%s is %s", o.name.c_str(), in_words(value));
  PetscFunctionReturn(0);
}

PetscErrorCode require_finite(MPI_Comm comm, const Dataset& table) {
  Error fault;
  PetscFunctionBegin;
  if (const auto* values = std::get_if<std::vector<double>>(&table.rows); values && !table.gaps) {
    const PetscInt at = first_not_finite(values->data(), static_cast<PetscInt>(values->size())), columns = std::max(1, table.columns);
    if (at < static_cast<PetscInt>(values->size())) note(table.path, table.first + at / columns, (*values)[static_cast<std::size_t>(at)], &fault);
  }
  if (fault) fault.text += ": it is not written";
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode require_finite(MPI_Comm comm, const std::string& name, Vec vec) {
  Error fault;
  PetscFunctionBegin;
  PetscCall(check_vector(name, vec, false, &fault));
  if (fault) fault.text += ": it is not written";
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
