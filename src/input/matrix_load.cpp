#include "input/matrix_load.hpp"
#include <algorithm>
#include <fstream>
#include <sstream>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/handle.hpp"
#include "base/memory.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "input/matrix_text.hpp"

namespace bs {
namespace {

constexpr std::size_t PIECE = 1 << 16;  // entries handed out at a time

bool is_binary(const std::string& path) {
  for (const char* end : {".bin", ".petsc", ".dat"}) {
    const std::string tail = end;
    if (path.size() > tail.size() && path.compare(path.size() - tail.size(), tail.size(), tail) == 0) return true;
  }
  return false;
}

bool is_matrix_market(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  char head[14] = {};
  in.read(head, sizeof head);
  return lower({head, static_cast<std::size_t>(in.gcount())}) == "%%matrixmarket";
}

/// Rank 0 examines the file; every rank gets the same answer: whether it is text (Matrix Market).
PetscErrorCode find_format(MPI_Comm comm, const std::string& path, const std::string& option, bool* text) {
  Error fault;
  PetscFunctionBegin;
  const std::string wrong = rank_of(comm) == 0 ? examine_file(comm, path).error : "";
  if (!wrong.empty()) fault.note(0, "option " + option + ": " + wrong);
  PetscCall(fail_if_any(comm, fault));
  *text = ask_rank_0(comm, [&] { return is_matrix_market(path); });
  PetscFunctionReturn(0);
}

/// This rank's entries as three lists.
struct Entries {
  std::vector<PetscInt> i, j;
  std::vector<PetscScalar> v;
};

/// One piece: rank 0 sorts `piece` by owner and every rank appends what is its own.
PetscErrorCode hand_out(MPI_Comm comm, const std::vector<MatrixEntry>& piece, const std::vector<PetscInt>& first, Entries* mine) {
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  std::vector<int> bytes(size, 0), offset(size, 0);
  std::vector<MatrixEntry> sorted(piece.size());
  constexpr int unit = static_cast<int>(sizeof(MatrixEntry));
  if (rank == 0) {
    const auto owner = [&](const MatrixEntry& e) {
      return static_cast<std::size_t>(std::upper_bound(first.begin(), first.end() - 1, e.row) - first.begin() - 1);
    };
    for (const MatrixEntry& e : piece) bytes[owner(e)] += unit;
    for (int r = 1; r < size; ++r) offset[r] = offset[r - 1] + bytes[r - 1];
    std::vector<int> next = offset;
    for (const MatrixEntry& e : piece) {
      int& at = next[owner(e)];
      sorted[at / unit] = e;
      at += unit;
    }
  }
  int count = 0;
  PetscCallMPI(MPI_Scatter(bytes.data(), 1, MPI_INT, &count, 1, MPI_INT, 0, comm));
  std::vector<MatrixEntry> own(count / unit);
  PetscCallMPI(MPI_Scatterv(sorted.data(), bytes.data(), offset.data(), MPI_BYTE, own.data(), count, MPI_BYTE, 0, comm));
  for (const MatrixEntry& e : own) {
    mine->i.push_back(static_cast<PetscInt>(e.row));
    mine->j.push_back(static_cast<PetscInt>(e.column));
    mine->v.push_back(e.value);
  }
  PetscFunctionReturn(0);
}

/// Piece after piece until rank 0 has read all or met a fault.
template <class Reader>
PetscErrorCode stream(MPI_Comm comm, Reader& reader, const std::vector<PetscInt>& first, Entries* mine) {
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  for (;;) {
    std::vector<MatrixEntry> piece;
    MatrixEntry entry;
    while (rank == 0 && piece.size() < PIECE && reader.next(&entry)) piece.push_back(entry);
    int more = !piece.empty();
    PetscCallMPI(MPI_Bcast(&more, 1, MPI_INT, 0, comm));
    if (!more) break;
    PetscCall(hand_out(comm, piece, first, mine));
  }
  Error fault;
  if (!reader.error().empty()) fault.note(reader.line(), reader.error());
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

/// Entries that rank 0 reads, spread over the ranks and summed where they repeat.
template <class Reader>
PetscErrorCode load_entries(MPI_Comm comm, const std::string& path, Reader& reader, Mat* out) {
  std::int64_t sizes[2] = {0, 0};
  Error fault;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  if (rank == 0) {
    if (!reader.open()) fault.note(reader.line(), reader.error());
    sizes[0] = reader.rows();
    sizes[1] = reader.columns();
    if (std::max(sizes[0], sizes[1]) > PETSC_MAX_INT / 2)
      fault.note(reader.line(), path + ": too many rows or columns for this PETSc: use a build with 64-bit indices");
  }
  PetscCall(fail_if_any(comm, fault));
  PetscCallMPI(MPI_Bcast(sizes, 2, MPI_INT64_T, 0, comm));
  // at least the start, the length and the room of every row
  const double bytes = 3.0 * sizeof(PetscInt) * static_cast<double>(sizes[0]) / size;
  PetscCall(reserve_memory(comm, {path + ": a matrix of " + how_many(sizes[0], "row"), bytes, ""}));
  MatHandle matrix;
  PetscCall(MatCreate(comm, matrix.out()));
  PetscCall(MatSetSizes(matrix, PETSC_DECIDE, PETSC_DECIDE, static_cast<PetscInt>(sizes[0]), static_cast<PetscInt>(sizes[1])));
  PetscCall(MatSetType(matrix, MATAIJ));
  PetscLayout by_row, by_column;
  PetscCall(MatGetLayouts(matrix, &by_row, &by_column));
  PetscCall(PetscLayoutSetUp(by_row));
  PetscCall(PetscLayoutSetUp(by_column));
  const PetscInt* ranges = nullptr;
  PetscCall(MatGetOwnershipRanges(matrix, &ranges));
  Entries mine;
  PetscCall(stream(comm, reader, std::vector<PetscInt>(ranges, ranges + size + 1), &mine));
  PetscCall(MatSetPreallocationCOO(matrix, static_cast<PetscCount>(mine.i.size()), mine.i.data(), mine.j.data()));
  PetscCall(MatSetValuesCOO(matrix, mine.v.data(), ADD_VALUES));
  // without the lists that a second filling would use
  PetscCall(MatDuplicate(matrix, MAT_COPY_VALUES, out));
  PetscFunctionReturn(0);
}

/// The class id at the head of a PETSc binary file; rank 0 learns the size of its integers.
PetscErrorCode check_binary(MPI_Comm comm, const std::string& path, const std::string& option, std::int64_t wanted, const char* what,
                            int* index_bytes) {
  Error fault;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0 && petsc_class_id(path, index_bytes) != wanted)
    fault.note(0, format("option %s: %s is neither Matrix Market text nor a PETSc binary %s: begin text with '%%%%MatrixMarket matrix coordinate "
                         "real general'",
                         option.c_str(), path.c_str(), what));
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

/// Rank 0 reads, all get the values.
PetscErrorCode load_binary_vector(MPI_Comm comm, const std::string& path, const std::string& option, std::vector<double>* values) {
  Error fault;
  int index_bytes = 4;
  PetscFunctionBegin;
  PetscCall(check_binary(comm, path, option, PETSC_VECTOR_CLASS_ID, "vector", &index_bytes));
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0) {
    const std::string error = read_petsc_vector(path, index_bytes, values);
    if (!error.empty()) fault.note(0, "option " + option + ": " + error);
  }
  PetscCall(fail_if_any(comm, fault));
  std::int64_t count = static_cast<std::int64_t>(values->size());
  PetscCallMPI(MPI_Bcast(&count, 1, MPI_INT64_T, 0, comm));
  values->resize(static_cast<std::size_t>(count));
  PetscCallMPI(MPI_Bcast(values->data(), static_cast<PetscMPIInt>(count), MPI_DOUBLE, 0, comm));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode load_matrix(MPI_Comm comm, const std::string& path, const std::string& option, Mat* out) {
  bool text = false;
  int index_bytes = 4;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  PetscCall(find_format(comm, path, option, &text));
  if (text || !is_binary(path)) {
    std::ifstream file;
    if (rank == 0) file.open(path, std::ios::binary);
    MatrixMarketReader reader(file, path);
    PetscCall(load_entries(comm, path, reader, out));
    PetscFunctionReturn(0);
  }
  PetscCall(check_binary(comm, path, option, PetscMatrixReader::CLASS_ID, "matrix", &index_bytes));
  PetscMatrixReader reader(path, index_bytes);
  PetscCall(load_entries(comm, path, reader, out));
  PetscFunctionReturn(0);
}

PetscErrorCode load_vector(MPI_Comm comm, const std::string& path, const std::string& option, Vec x, std::vector<std::string>* names) {
  bool market = false;
  PetscInt n, first, last;
  PetscFunctionBegin;
  names->clear();
  PetscCall(VecGetSize(x, &n));
  PetscCall(VecGetOwnershipRange(x, &first, &last));
  PetscCall(find_format(comm, path, option, &market));
  std::vector<double> values;
  std::string text;
  std::string error;
  const bool binary = !market && is_binary(path);
  if (binary) PetscCall(load_binary_vector(comm, path, option, &values));
  else PetscCall(read_text_file(comm, path, &text));
  if (binary) {
    if (values.size() != static_cast<std::size_t>(n))
      error = path + " has " + how_many(static_cast<std::int64_t>(values.size()), "entr{y|ies}") + " for " + how_many(n, "state");
  } else if (market) {
    std::istringstream in(text);
    MatrixMarketReader reader(in, path);
    MatrixEntry entry;
    if (reader.open() && reader.columns() != 1) error = path + ": " + how_many(reader.columns(), "column") + ": a vector has one";
    if (error.empty() && reader.error().empty() && reader.rows() == n) {
      values.assign(static_cast<std::size_t>(n), 0.0);
      while (reader.next(&entry)) values[static_cast<std::size_t>(entry.row)] += entry.value;
    } else {
      values.resize(1);
    }
    if (error.empty()) error = reader.error();
    if (error.empty() && reader.rows() != n) error = path + ": " + how_many(reader.rows(), "row") + " for " + how_many(n, "state");
  } else {
    error = read_vector_csv(text, path, &values, names);
    if (error.empty() && values.size() != static_cast<std::size_t>(n))
      error = path + ": " + how_many(static_cast<std::int64_t>(values.size()), "number") + " for " + how_many(n, "state");
  }
  if (!error.empty()) PetscCall(fail(comm, Exit::input, "option " + option + ": " + error));
  const WriteArray ax(x);
  for (PetscInt k = first; k < last; ++k) ax[k - first] = values[static_cast<std::size_t>(k)];
  PetscFunctionReturn(0);
}

}  // namespace bs
