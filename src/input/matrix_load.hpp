// Matrices and vectors from files, distributed by rows as they are read.
#pragma once
#include <petscmat.h>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>
#include "input/matrix_text.hpp"

namespace bs {

/// Collective. `path`: Matrix Market text (.mtx, or a first line that begins with %%MatrixMarket) or PETSc binary
/// (.bin, .petsc, .dat). Rank 0 reads it and hands each piece of it to the owners of its rows at once. `option` is named in messages. Exit code 2
/// if it cannot be read.
PetscErrorCode load_matrix(MPI_Comm comm, const std::string& path, const std::string& option, Mat* out);

/// Collective. Fills `x`, whose layout is set, from Matrix Market (one column), PETSc binary (a Vec), or CSV: a number
/// a line, or `name,value` with a header; `names` receives the names, if there are any (on every rank).
PetscErrorCode load_vector(MPI_Comm comm, const std::string& path, const std::string& option, Vec x, std::vector<std::string>* names);

// PETSc's binary files of matrices and vectors, read entry by entry and checked as strictly as text.

/// A sparse matrix: big-endian integers of `index_bytes` (4 or 8) each: class id, rows, columns, entries, the length of every
/// row, the column of every entry from 0; then every value as a double. The file must have just the size these ask for.
class PetscMatrixReader {
 public:
  static constexpr std::int64_t CLASS_ID = 1211216;
  PetscMatrixReader(const std::string& path, int index_bytes) : name_(path), index_bytes_(index_bytes) {}
  /// Reads the head and the lengths of the rows. False: see error().
  bool open();
  std::int64_t rows() const { return rows_; }
  std::int64_t columns() const { return columns_; }
  /// The next entry; false at the end and after an error.
  bool next(MatrixEntry* entry);
  /// One line with file, place and remedy; empty if all is well.
  const std::string& error() const { return error_; }
  /// Of the present row, from 1: what orders faults.
  std::int64_t line() const { return row_ + 1; }

 private:
  bool read_row();
  bool fail(const std::string& what);
  std::string name_, error_;
  int index_bytes_;
  std::ifstream indices_, numbers_;  ///< at the columns and the values of the rows to come
  std::int64_t rows_ = 0, columns_ = 0, count_ = 0, row_ = -1;
  std::vector<std::int64_t> lengths_, row_columns_;
  std::vector<double> row_values_;
  std::size_t at_ = 0;  ///< in the present row
};

/// A vector: class id and length as above, then the values. Returns what is wrong, or nothing.
std::string read_petsc_vector(const std::string& path, int index_bytes, std::vector<double>* values);

/// The class id at the head of a file; 0 if it is too short for one. index_bytes: 4, or 8 where a PETSc with 64-bit indices wrote it (the first half
/// of its class id is 0).
std::int64_t petsc_class_id(const std::string& path, int* index_bytes);

constexpr std::int64_t PETSC_VECTOR_CLASS_ID = 1211214;

}  // namespace bs
