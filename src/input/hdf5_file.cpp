#include "input/hdf5_file.hpp"
#include <algorithm>
#include <cinttypes>
#include <limits>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/memory.hpp"

namespace bs {

namespace {

std::string last_reason() {
  const std::string text = h5_words();
  return (text.empty() ? "no reason given" : text) + if_out_of_memory();
}

/// The file is checked on one rank before all open it. Truncation shows only on opening.
void check_file(MPI_Comm comm, const std::string& path, std::int64_t* bytes, Error* fault) {
  const FileStatus found = examine_file(comm, path);
  *bytes = found.bytes;
  if (!found.error.empty()) return fault->note(0, found.error);
  if (H5Fis_hdf5(path.c_str()) <= 0)
    return fault->note(0, path + ": is not an HDF5 file (" + how_many(found.bytes, "byte") + "); write it again, for instance with h5py");
  const H5 file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file) fault->note(0, format("%s: truncated or damaged HDF5 file (%s); write it again", path.c_str(), last_reason().c_str()));
}

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return "(" + text + ")";
}

/// "(N, d) with d = 1, 2 or 3", "(M, 2)", "(7)"
std::string needed(const TableShape& shape) {
  std::vector<std::string> words;
  if (shape.frames) words.push_back("T");
  words.push_back(shape.rows == TableShape::any ? shape.row_name : std::to_string(shape.rows));
  if (shape.columns != 0) words.push_back(shape.columns == TableShape::any ? "d" : std::to_string(shape.columns));
  return join(words) + (shape.columns == TableShape::any ? " with d = 1, 2 or 3" : "");
}

const char* class_name(H5T_class_t type) {
  switch (type) {
    case H5T_INTEGER: return "integers";
    case H5T_FLOAT: return "floating-point numbers";
    case H5T_STRING: return "strings";
    case H5T_COMPOUND: return "compounds";
    case H5T_ENUM: return "an enumeration";
    default: return "neither integers nor floating-point numbers";
  }
}

/// Most bytes of data that `dataset` can hold: deflate, the densest of HDF5's usual filters, packs 1032 to 1.
double most_bytes(hid_t dataset, std::int64_t file_bytes) {
  const H5 list(H5Dget_create_plist(dataset), H5Pclose);
  const double stored = std::min(static_cast<double>(H5Dget_storage_size(dataset)), static_cast<double>(file_bytes));
  if (list && H5Pget_layout(list) == H5D_CHUNKED && H5Pget_nfilters(list) > 0) return 1032.0 * stored + 65536;
  return stored;
}

}  // namespace

PetscErrorCode Hdf5File::open(MPI_Comm comm, const std::string& path) {
  Error fault;
  PetscFunctionBegin;
  comm_ = comm;
  name_ = path;
  reading_.begin(path);
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0) check_file(comm, path, &bytes_, &fault);
  PetscCall(fail_if_any(comm, fault));
  PetscCallMPI(MPI_Bcast(&bytes_, 1, MPI_INT64_T, 0, comm));
  const H5 access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  if (!stay_within()) fault.note(0, path + ": HDF5 cannot be kept within the file (" + last_reason() + ")");
  const std::string place = path.size() == 1 ? "./" + path : path;  // Open MPI opens no name of one character
  if (H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL) >= 0) file_ = H5(H5Fopen(place.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
  if (!file_) fault.note(0, format("%s: HDF5 cannot open it in parallel (%s)", path.c_str(), last_reason().c_str()));
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

bool Hdf5File::has(const std::string& path) const {
  elsewhere_ = {};
  for (std::size_t slash = path.find('/', 1); slash != std::string::npos; slash = path.find('/', slash + 1))
    if (H5Lexists(file_, path.substr(0, slash).c_str(), links_) <= 0) return elsewhere_.second;  // what leads elsewhere is there, and refused
  return H5Lexists(file_, path.c_str(), links_) > 0 || elsewhere_.second;
}

std::string Hdf5File::fault_of(hid_t dataset, const std::string& path, const TableShape& shape, Table* out) const {
  const std::string begin = name_ + ": " + path;
  const H5 type(H5Dget_type(dataset), H5Tclose), space(H5Dget_space(dataset), H5Sclose);
  if (!type || !space) return begin + ": damaged (" + last_reason() + "); write it again";

  const H5T_class_t kind = H5Tget_class(type);
  out->truths = kind == H5T_ENUM;
  if (out->truths && shape.integers && !shape.truths)
    return begin + ": holds truth values (" + class_name(kind) +
           "), needs integers; write the rows that are meant, in numpy by numpy.flatnonzero(mask)";
  const bool integers = kind == H5T_INTEGER || out->truths;
  if (!integers && (shape.integers || kind != H5T_FLOAT))
    return begin + ": holds " + class_name(kind) + ", needs " + (shape.integers ? "integers" : "numbers") +
           (kind == H5T_FLOAT ? "; convert it, in numpy by .astype('int64')" : "; write numbers");

  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> dims(static_cast<std::size_t>(std::max(rank, 0)));
  if (rank > 0) (void)H5Sget_simple_extent_dims(space, dims.data(), nullptr);
  std::vector<std::string> found;
  found.reserve(dims.size());
  for (const hsize_t n : dims) found.push_back(std::to_string(n));
  const std::string wrong = begin + ": shape " + join(found) + ", needs " + needed(shape);
  const std::size_t row_axis = shape.frames ? 1 : 0;
  if (H5Sget_simple_extent_type(space) != H5S_SIMPLE || dims.size() != row_axis + 1 + (shape.columns != 0 ? 1 : 0)) return wrong;
  out->rows = static_cast<std::int64_t>(dims[row_axis]);
  if (shape.frames) {
    out->frames = static_cast<std::int64_t>(dims[0]);
    if (out->frames < 1) return begin + ": holds no frame; give a file with at least one";
  }
  if (out->rows < 0 || (shape.rows != TableShape::any && out->rows != shape.rows)) return wrong;
  if (shape.columns != 0) {
    const hsize_t columns = dims.back();
    if (shape.columns == TableShape::any ? columns < 1 || columns > 3 : columns != static_cast<hsize_t>(shape.columns)) return wrong;
    out->columns = static_cast<int>(columns);
  }
  return {};
}

PetscErrorCode Hdf5File::find(const std::string& path, const TableShape& shape, Table* out) const {
  Error fault;
  PetscFunctionBegin;
  *out = Table{};
  out->path = path;
  elsewhere_ = {};
  if (!has(path)) {
    fault.note(0, format("%s: has no dataset %s; write one of shape %s", name_.c_str(), path.c_str(), needed(shape).c_str()));
  } else {
    out->dataset = H5(H5Dopen2(file_, path.c_str(), sets_), H5Dclose);
    const std::string elsewhere = out->dataset ? fault_of_place(out->dataset, path) : elsewhere_.second ? fault_of_link(path) : "";
    if (!elsewhere.empty()) fault.note(0, elsewhere);
    else if (!out->dataset)
      fault.note(0, format("%s: %s is not a dataset that can be opened (%s); write one of shape %s", name_.c_str(), path.c_str(),
                           last_reason().c_str(), needed(shape).c_str()));
    else fault.note(0, fault_of(out->dataset, path, shape, out));
  }
  PetscCall(fail_if_any(comm_, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Hdf5File::require_data(const Table& table) const {
  Error fault;
  PetscFunctionBegin;
  if (table.dataset) {
    const H5 type(H5Dget_type(table.dataset), H5Tclose);
    const double declared = static_cast<double>(H5Tget_size(type)) * static_cast<double>(std::max<std::int64_t>(table.frames, 1)) *
                            static_cast<double>(table.rows) * std::max(table.columns, 1);
    if (declared > most_bytes(table.dataset, bytes_))
      fault.note(0, format("%s: %s declares %s (%.0f bytes), the file (%s) does not hold %s: "
                           "never written, truncated or damaged; write it again",
                           name_.c_str(), table.path.c_str(), how_many(table.rows, "row").c_str(), declared, how_many(bytes_, "byte").c_str(),
                           table.rows == 1 ? "it" : "them"));
  }
  PetscCall(fail_if_any(comm_, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Hdf5File::read_raw(const Table& table, std::int64_t first, std::int64_t count, int columns, hid_t type, void* out) const {
  std::vector<hsize_t> start, block;
  Error fault;
  PetscFunctionBegin;
  if (table.frames > 0) {
    start.push_back(static_cast<hsize_t>(table.frames - 1));
    block.push_back(1);
  }
  start.push_back(static_cast<hsize_t>(first));
  block.push_back(static_cast<hsize_t>(count));
  if (table.columns > 0) {
    start.push_back(0);
    block.push_back(static_cast<hsize_t>(columns));
  }
  if (count > 0) {
    const H5 memory(H5Screate_simple(static_cast<int>(block.size()), block.data(), nullptr), H5Sclose);
    const H5 file(H5Dget_space(table.dataset), H5Sclose);
    // Independent transfer (the default): a rank that meets a damaged block cannot leave the others waiting.
    if (H5Sselect_hyperslab(file, H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) < 0 ||
        H5Dread(table.dataset, type, memory, file, H5P_DEFAULT, out) < 0)
      fault.note(first, format("%s: %s: rows %" PRId64 " to %" PRId64 " cannot be read (%s); write the file again", name_.c_str(), table.path.c_str(),
                               first, first + count - 1, last_reason().c_str()));
  }
  PetscCall(fail_if_any(comm_, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Hdf5File::read(const Table& table, std::int64_t first, std::int64_t count, int columns, std::vector<double>* out) const {
  PetscFunctionBegin;
  if (columns == 0) columns = std::max(table.columns, 1);
  out->assign(static_cast<std::size_t>(count * columns), 0.0);
  PetscCall(read_raw(table, first, count, columns, H5T_NATIVE_DOUBLE, out->data()));
  PetscFunctionReturn(0);
}

/// HDF5 makes the ends of the range of what lies beyond it.
PetscErrorCode Hdf5File::require_whole(const Table& table, std::int64_t first, int columns, const std::vector<std::int64_t>& values) const {
  constexpr std::int64_t LEAST = std::numeric_limits<std::int64_t>::min(), MOST = std::numeric_limits<std::int64_t>::max();
  Error fault;
  PetscFunctionBegin;
  const auto end = std::find_if(values.begin(), values.end(), [](std::int64_t value) { return value == LEAST || value == MOST; });
  if (end != values.end()) {
    const std::int64_t row = first + (end - values.begin()) / columns;
    fault.note(row, format("%s: %s: row %" PRId64 " holds a whole number of 2^63 - 1 or more in size; write smaller ones", name_.c_str(),
                           table.path.c_str(), row));
  }
  PetscCall(fail_if_any(comm_, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Hdf5File::read(const Table& table, std::int64_t first, std::int64_t count, int columns, std::vector<std::int64_t>* out) const {
  PetscFunctionBegin;
  if (columns == 0) columns = std::max(table.columns, 1);
  out->assign(static_cast<std::size_t>(count * columns), 0);
  PetscCall(read_raw(table, first, count, columns, H5T_NATIVE_INT64, out->data()));
  PetscCall(require_whole(table, first, columns, *out));
  PetscFunctionReturn(0);
}

std::vector<std::string> Hdf5File::members(const std::string& group) const {
  std::vector<std::string> names;
  const auto keep = [](hid_t, const char* name, const H5L_info_t*, void* data) -> herr_t {
    static_cast<std::vector<std::string>*>(data)->push_back(name);
    return 0;
  };
  if (group == "/" || has(group)) (void)H5Literate_by_name(file_, group.c_str(), H5_INDEX_NAME, H5_ITER_INC, nullptr, keep, &names, links_);
  return names;
}

}  // namespace bs
