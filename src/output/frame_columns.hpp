// The growing datasets of a trajectory, and the rows of them that wait in memory to be written together.
#pragma once
#include <cstdint>
#include <string>
#include <vector>
#include "output/tables.hpp"
#include "systems/model.hpp"

namespace bs {

/// Rows of `value` in GROUP, one frame after the other; what of them waits is this rank's rows alone.
class FieldColumn {
 public:
  /// `columns`: numbers written per particle at least (zeros are appended). Nothing of the file is touched.
  PetscErrorCode describe(const Field& field, PetscInt columns);
  /// On the ranks that have the file open: makes GROUP/value without rows (chunks of several frames where these are small, of one
  /// otherwise, and then not filled with zeros before they are written), or opens it.
  PetscErrorCode create(hid_t file, bool single);
  PetscErrorCode open(hid_t file);
  /// A continued file of an earlier version of the program has no such column: nothing is written.
  void leave_out() { left_out_ = true; }
  const std::string& group() const { return group_; }
  const Powers& powers() const { return powers_; }
  hid_t id() const { return set_; }
  /// Numbers of a row.
  PetscInt width() const { return width_; }
  /// Bytes of a frame.
  std::int64_t size() const { return std::int64_t{8} * total_ * width_; }
  /// Bytes of `frames` frames in the file at most, with what chunks hold besides.
  std::int64_t bytes(std::int64_t frames) const;
  /// Local. Keeps a copy of the frame, or (not `copy`, where it has a source or nothing is to be appended to its rows) where it is until done().
  PetscErrorCode hold(const Field& field, bool copy);
  /// Collective. Rank 0 receives the rows of all ranks of the `frames` that wait.
  PetscErrorCode gather(MPI_Comm comm, std::int64_t frames);
  PetscErrorCode extend(std::int64_t frames);
  /// Writes `count` of the waiting frames, from number `first` on, as frames `at`, ... of the file.
  PetscErrorCode write(std::int64_t at, std::int64_t first, std::int64_t count, hid_t transfer);
  /// Whether the frame that was taken is made row by row as it is written, by write_piece: as frame `at`, at most `count` rows from row `first` on.
  bool in_pieces() const { return static_cast<bool>(later_.source); }
  PetscInt rows() const { return rows_; }
  PetscErrorCode write_piece(std::int64_t at, PetscInt first, PetscInt count, hid_t transfer);
  /// The first `count` waiting frames are written.
  PetscErrorCode done(std::int64_t count);
  void close() { set_.reset(); }

 private:
  PetscErrorCode rows(const Field& field, PetscInt first, PetscInt count, double* to) const;
  PetscErrorCode write_rows(const hsize_t* start, const hsize_t* size, hid_t transfer, const double* data) const;
  std::string group_;
  PetscInt first_ = 0, rows_ = 0, total_ = 0;  ///< of this rank, of all
  PetscInt block_ = 1, width_ = 1;             ///< numbers of a row in the Vec, and in the file
  bool flat_ = false;                          ///< rows of one number have no axis of their own
  bool whole_ = false, left_out_ = false;      ///< whole numbers
  Powers powers_;
  H5 set_;
  std::vector<double> waiting_;  ///< frames x rows x width
  std::vector<double> all_;      ///< rank 0: the same of all ranks, once gathered
  std::vector<double> piece_;    ///< of a frame that is made as it is written
  Field later_ = {};             ///< borrowed: the frame itself
  bool gathered_ = false;
};

/// One observable, the same on every rank.
struct ObservableColumn {
  std::string name;
  int width = 1;
  int columns = 0;  ///< of the matrix that it is; 0: none
  Powers powers = {};
  GrowingColumn column;
  std::vector<double> waiting;
  bool left_out = false;  ///< a continued file of an earlier version of the program has no such column
  /// Absolute names are paths of their own.
  std::string group() const { return name.front() == '/' ? name : "/observables/" + name; }
};

}  // namespace bs
