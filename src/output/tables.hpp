// Datasets of the trajectory that PETSc's viewer cannot write: growing columns, and tables written once.
#pragma once
#include <petscsys.h>
#include <string>
#include <vector>
#include "output/h5.hpp"
#include "systems/model.hpp"
#include "systems/system.hpp"

namespace bs {

/// A dataset (T), (T, width) or (T, width / columns, columns) that grows by rows of float64 or int64, written by rank 0 of comm.
class GrowingColumn {
 public:
  /// Collective. width 0: one-dimensional; columns: of the matrix that a row is, 0: it is none. The group above must exist. `chunk`: rows allocated
  /// at a time.
  PetscErrorCode create(MPI_Comm comm, hid_t file, const std::string& path, bool integer, int width, int chunk, int columns = 0);
  /// Collective. Opens a column that exists; its next row is number `rows`.
  PetscErrorCode open(MPI_Comm comm, hid_t file, const std::string& path, std::int64_t rows);
  /// Collective. Allocates `count` rows more, which append() then fills.
  PetscErrorCode extend(std::int64_t count);
  /// Collective. Appends `count` rows (the same count on every rank); `data` is read on rank 0 only.
  PetscErrorCode append(std::int64_t count, const void* data);
  hid_t id() const { return set_; }
  int width() const { return width_; }

 private:
  H5 set_;
  bool writer_ = false, integer_ = false;
  void set_shape(int width, int columns);
  int rank_ = 1;
  hsize_t shape_[3] = {0, 0, 0};  ///< of a row, from the second place on
  int width_ = 0;
  hsize_t rows_ = 0;
};

/// Collective. A dataset (count, rows, columns) of float64 that write_page() fills; the groups above it are created.
PetscErrorCode create_pages(hid_t file, const std::string& path, std::int64_t count, std::int64_t rows, std::int64_t columns, H5* set);

/// Page k of it from a vector whose block size is the number of columns, each rank its rows.
PetscErrorCode write_page(hid_t set, std::int64_t k, Vec vec);

/// Collective. Rank 0 receives the rows of all ranks; the others keep none.
PetscErrorCode gather_table(MPI_Comm comm, Dataset* table);

/// Collective. Writes a table in parallel, each rank its rows; the groups above it are created.
PetscErrorCode write_table(hid_t file, const Dataset& table);

/// Bytes of such tables, and of headers.
std::int64_t table_bytes(const std::vector<Dataset>& tables);

/// Collective. The same into the dataset that is there, which has the table's shape.
PetscErrorCode refill_table(hid_t file, const Dataset& table);

// Nothing that is not finite is written.

/// Collective. The first quantity of a frame that is not finite, with its row, in words; empty: all of it is finite.
PetscErrorCode find_not_finite(MPI_Comm comm, const std::vector<Field>& fields, const std::vector<Observable>& observables, std::string* what);

/// Collective. Ends the run with exit code 3 where a table, or a vector that is written under `name`, holds a number that is not finite.
PetscErrorCode require_finite(MPI_Comm comm, const Dataset& table);
PetscErrorCode require_finite(MPI_Comm comm, const std::string& name, Vec vec);

}  // namespace bs
