// Reading an HDF5 file in parallel: tables whose shape, type and size are checked before anything is allocated, and
// rows by hyperslabs. HDF5's own messages are suppressed; an error is reported in one line and ends the run with exit code 2.
#pragma once
#include <hdf5.h>
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/h5_handle.hpp"

namespace bs {

/// Turns HDF5's error messages off while it lives.
class QuietHdf5 {
 public:
  QuietHdf5() {
    (void)H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    (void)H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;
  ~QuietHdf5() { (void)H5Eset_auto2(H5E_DEFAULT, print_, data_); }

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// What a table must look like: [frames,] rows [, columns].
struct TableShape {
  static constexpr std::int64_t any = -1;
  bool integers = false;       ///< integers, else integers or floating-point numbers
  bool truths = false;         ///< truth values, which h5py writes as an enumeration, may stand for integers
  std::int64_t rows = any;     ///< any: this table says how many there are
  std::string row_name = "N";  ///< how messages call the number of rows
  int columns = 0;             ///< 0: one-dimensional; any: 1, 2 or 3
  bool frames = false;         ///< a first axis of frames, at least one; the last is read
};

/// A dataset that was found to have the shape asked for.
struct Table {
  std::string path;
  H5 dataset;
  std::int64_t frames = 0, rows = 0;  ///< frames = 0: no such axis
  int columns = 0;                    ///< 0: one-dimensional
  bool truths = false;                ///< it holds truth values
};

class Hdf5File {
 public:
  /// Collective. Errors: missing, not HDF5, truncated or damaged.
  PetscErrorCode open(MPI_Comm comm, const std::string& path);
  /// Whether an object of that absolute path exists. Local, the same on every rank.
  bool has(const std::string& path) const;
  /// Collective. Errors: not there, not a dataset, wrong type or shape.
  PetscErrorCode find(const std::string& path, const TableShape& shape, Table* out) const;
  /// Collective. A table that was found, or an empty one, must hold as much data as it declares: before its numbers of
  /// rows rule what is allocated.
  PetscErrorCode require_data(const Table& table) const;
  /// Collective. This rank's rows [first, first + count) of `table`, its first `columns` columns (0: all).
  PetscErrorCode read(const Table& table, std::int64_t first, std::int64_t count, int columns, std::vector<double>* out) const;
  PetscErrorCode read(const Table& table, std::int64_t first, std::int64_t count, int columns, std::vector<std::int64_t>* out) const;
  /// Collective. The text of a string attribute of object `path`; empty if there is no such attribute.
  PetscErrorCode text_attribute(const std::string& path, const std::string& name, std::string* out) const;
  /// Collective. The words of a string attribute: a list of strings, or one string with commas between them; empty if there is no
  /// such attribute.
  PetscErrorCode words_attribute(const std::string& path, const std::string& name, std::vector<std::string>* out) const;
  /// The links of a group; empty if there is no such group. Local, the same on every rank.
  std::vector<std::string> members(const std::string& group) const;
  hid_t id() const { return file_; }
  std::int64_t bytes() const { return bytes_; }
  /// A group, or none (id < 0) where it is not there or not in this file.
  H5 group(const std::string& path) const;
  /// Access lists for objects and links of this file: links to other files are not followed.
  hid_t links() const { return links_; }

 private:
  PetscErrorCode require_whole(const Table& table, std::int64_t first, int columns, const std::vector<std::int64_t>& values) const;
  PetscErrorCode read_raw(const Table& table, std::int64_t first, std::int64_t count, int columns, hid_t type, void* out) const;
  std::string fault_of(hid_t dataset, const std::string& path, const TableShape& shape, Table* out) const;
  /// The strings of an attribute; `one`: it must be a single one.
  PetscErrorCode strings(const std::string& path, const std::string& name, bool one, std::vector<std::string>* out) const;
  bool stay_within();  ///< makes links_, sets_, groups_
  std::string fault_of_place(hid_t dataset, const std::string& path) const;
  std::string fault_of_link(const std::string& path) const;
  QuietHdf5 quiet_;  // before file_: it must outlive it
  ReadingFile reading_;
  MPI_Comm comm_ = MPI_COMM_NULL;
  std::string name_;
  std::int64_t bytes_ = 0;
  H5 file_;
  H5 links_, sets_, groups_;                        ///< how links, datasets and groups are opened
  mutable std::pair<std::string, bool> elsewhere_;  ///< the file that a link met last leads to, and whether one was met
};

}  // namespace bs
