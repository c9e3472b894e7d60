#include "systems/particles/row_pattern.hpp"
#include <algorithm>
#include <cstring>
#include <string>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {

void RowPattern::create(const Network& net) {
  const Links& links = net.links;
  start_.assign(1, 0);
  global_.clear();
  slot_.assign(links.other.size(), -1);
  low_.assign(static_cast<std::size_t>(net.n), 0);
  own_ = self_ = low_;
  std::vector<PetscInt> columns;
  for (PetscInt i = 0; i < net.n; ++i) {
    columns.assign(1, net.global[i]);
    // a fixed particle feels nothing
    if (!net.fixed[i])
      for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e)
        if (has_block(net, e)) columns.push_back(net.global[links.other[e]]);
    std::sort(columns.begin(), columns.end());
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
    const auto place = [&](PetscInt global) {
      return static_cast<PetscInt>(std::lower_bound(columns.begin(), columns.end(), global) - columns.begin());
    };
    self_[i] = place(net.global[i]);
    low_[i] = place(net.first);
    own_[i] = place(net.first + net.n) - low_[i];
    if (!net.fixed[i])
      for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e)
        if (has_block(net, e)) slot_[e] = place(net.global[links.other[e]]);
    global_.insert(global_.end(), columns.begin(), columns.end());
    start_.push_back(static_cast<PetscInt>(global_.size()));
    widest_ = std::max(widest_, static_cast<PetscInt>(columns.size()));
  }
}

double RowPattern::jacobian_bytes(int dim) const {
  const double rows = static_cast<double>(self_.size()) * dim, entries = 2 * rows + 2.0 * dim * dim * static_cast<double>(blocks());
  return entries * (sizeof(PetscScalar) + sizeof(PetscInt)) + 2 * rows * sizeof(PetscInt);
}

PetscErrorCode RowPattern::preallocate(const Network& net, Mat A) const {
  const PetscInt d = net.dim, bs = 2 * d;
  PetscFunctionBegin;
  std::vector<PetscInt> own(static_cast<std::size_t>(net.n) * bs, 2), other(own.size(), 0), own_blocks, other_blocks;
  for (PetscInt i = 0; i < net.n; ++i) {
    for (PetscInt k = d; k < bs; ++k) {
      own[i * bs + k] = own_[i] * bs;
      other[i * bs + k] = (count(i) - own_[i]) * bs;
    }
    own_blocks.push_back(own_[i]);
    other_blocks.push_back(count(i) - own_[i]);
  }
  PetscBool seq = PETSC_FALSE, mpi = PETSC_FALSE;
  PetscCall(PetscObjectBaseTypeCompare(reinterpret_cast<PetscObject>(A), MATSEQAIJ, &seq));
  PetscCall(PetscObjectBaseTypeCompare(reinterpret_cast<PetscObject>(A), MATMPIAIJ, &mpi));
  if (seq) PetscCall(MatSeqAIJSetPreallocation(A, 0, own.data()));
  else if (mpi) PetscCall(MatMPIAIJSetPreallocation(A, 0, own.data(), 0, other.data()));
  else PetscCall(MatXAIJSetPreallocation(A, bs, own_blocks.data(), other_blocks.data(), nullptr, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode RowPattern::create_matrix(const Network& net, Mat* out) const {
  const PetscInt bs = 2 * net.dim;
  PetscFunctionBegin;
  PetscCall(check_type(net.comm));
  PetscCall(MatCreate(net.comm, out));
  PetscCall(MatSetSizes(*out, net.n * bs, net.n * bs, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*out, bs));
  PetscCall(MatSetType(*out, MATAIJ));
  PetscCall(MatSetFromOptions(*out));
  PetscCall(preallocate(net, *out));
  PetscCall(MatSetOption(*out, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  RowWriter writer(net, *this);
  std::vector<double> zeros(static_cast<std::size_t>(widest_ * bs * net.dim), 0.0);
  PetscCall(writer.begin(*out));
  for (PetscInt i = 0; i < net.n; ++i) PetscCall(writer.write(i, 0.0, 1.0, zeros.data()));
  PetscCall(writer.end());
  PetscCall(MatSetOption(*out, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode RowPattern::check_type(MPI_Comm comm) {
  char type[64] = MATAIJ;
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-mat_type", type, sizeof type, nullptr));
  const std::string given = type;
  const bool one_rank = given.compare(0, 3, "seq") == 0, any = given.compare(0, 3, "mpi") == 0;
  const std::string kind = one_rank || any ? given.substr(3) : given;
  bool known = given == MATIS || given == MATHYPRE;
  for (const char* name : {MATAIJ, MATBAIJ, MATAIJPERM, MATAIJSELL, MATAIJCRL}) known = known || kind == name;
  if (!known)
    PetscCall(fail(comm, Exit::input,
                   "option -mat_type: " + given +
                       " cannot hold the Jacobian of particles: give aij, baij, aijperm, aijsell, "
                       "aijcrl, is or hypre"));
  if (one_rank && size > 1)
    PetscCall(fail(comm, Exit::input, format("option -mat_type: %s works on one rank only, this run has %d: give %s", type, size, kind.c_str())));
  PetscFunctionReturn(0);
}

const double* complete_rows(const Network& net, const RowPattern& pattern, PetscInt i, int block, const SparseBlocks* blocks, double diagonal,
                            const double* panel, std::vector<double>* room) {
  const bool adds = blocks && blocks->count(i) > 0, holds = net.constraints->rolls();
  if (!adds && !holds) return panel;
  room->assign(panel, panel + pattern.count(i) * block * net.dim);
  if (adds) blocks->add_to_panel(i, net.global, pattern.columns(i), pattern.count(i), block, room->data());
  if (holds) net.constraints->hold_rows(i, pattern.columns(i), pattern.count(i), block, diagonal, room->data());
  return room->data();
}

PetscErrorCode RowWriter::begin(Mat A) {
  PetscBool seq = PETSC_FALSE, mpi = PETSC_FALSE, assembled = PETSC_FALSE;
  PetscFunctionBegin;
  matrix_ = A;
  diagonal_ = off_ = nullptr;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(A), MATSEQAIJ, &seq));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(A), MATMPIAIJ, &mpi));
  PetscCall(MatAssembled(A, &assembled));
  direct_ = (seq || mpi) && assembled;
  if (!direct_) PetscFunctionReturn(0);
  if (seq) diagonal_ = A;
  else PetscCall(MatMPIAIJGetSeqAIJ(A, &diagonal_, &off_, nullptr));
  PetscBool done = PETSC_FALSE;
  PetscInt rows = 0;
  PetscCall(MatGetRowIJ(diagonal_, 0, PETSC_FALSE, PETSC_FALSE, &rows, &diagonal_rows_, nullptr, &done));
  PetscCall(MatSeqAIJGetArray(diagonal_, &diagonal_values_));
  if (off_) {
    PetscCall(MatGetRowIJ(off_, 0, PETSC_FALSE, PETSC_FALSE, &rows, &off_rows_, nullptr, &done));
    PetscCall(MatSeqAIJGetArray(off_, &off_values_));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode RowWriter::write(PetscInt i, double sigma, double scale, const double* panel) {
  PetscFunctionBegin;
  panel = complete_rows(net_, pattern_, i, 2 * net_.dim, blocks_, sigma * scale, panel, &sum_);
  if (direct_) write_direct(i, sigma, scale, panel);
  else PetscCall(write_generic(i, sigma, scale, panel));
  PetscFunctionReturn(0);
}

// Columns of an assembled row ascend, and so do those of the pattern: each row is two or three runs of the panel.
void RowWriter::write_direct(PetscInt i, double sigma, double scale, const double* panel) {
  const PetscInt d = net_.dim, bs = 2 * d;
  const PetscInt low = pattern_.low_[i] * bs, own = pattern_.own_[i] * bs, width = pattern_.count(i) * bs;
  for (PetscInt k = 0; k < d; ++k) {
    double* x_row = diagonal_values_ + diagonal_rows_[i * bs + k];
    x_row[0] = scale * sigma;
    x_row[1] = -scale;
    const double* row = panel + k * width;
    std::memcpy(diagonal_values_ + diagonal_rows_[i * bs + d + k], row + low, static_cast<std::size_t>(own) * sizeof(double));
    if (width > own) {
      double* off_row = off_values_ + off_rows_[i * bs + d + k];
      std::memcpy(off_row, row, static_cast<std::size_t>(low) * sizeof(double));
      std::memcpy(off_row + low, row + low + own, static_cast<std::size_t>(width - low - own) * sizeof(double));
    }
  }
}

PetscErrorCode RowWriter::write_generic(PetscInt i, double sigma, double scale, const double* panel) {
  const PetscInt d = net_.dim, bs = 2 * d, g = net_.global[i] * bs;
  PetscFunctionBegin;
  columns_.clear();
  for (PetscInt k = pattern_.start_[i]; k < pattern_.start_[i + 1]; ++k)
    for (PetscInt c = 0; c < bs; ++c) columns_.push_back(pattern_.global_[k] * bs + c);
  for (PetscInt k = 0; k < d; ++k) {
    const PetscInt x_row = g + k, x_columns[2] = {g + k, g + d + k}, v_row = g + d + k;
    const PetscScalar x_values[2] = {scale * sigma, -scale};
    PetscCall(MatSetValues(matrix_, 1, &x_row, 2, x_columns, x_values, INSERT_VALUES));
    const PetscInt width = static_cast<PetscInt>(columns_.size());
    PetscCall(MatSetValues(matrix_, 1, &v_row, width, columns_.data(), panel + k * width, INSERT_VALUES));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode RowWriter::end() {
  PetscFunctionBegin;
  if (direct_) {
    PetscBool done = PETSC_FALSE;
    PetscInt rows = 0;
    PetscCall(MatRestoreRowIJ(diagonal_, 0, PETSC_FALSE, PETSC_FALSE, &rows, &diagonal_rows_, nullptr, &done));
    PetscCall(MatSeqAIJRestoreArray(diagonal_, &diagonal_values_));
    if (off_) {
      PetscCall(MatRestoreRowIJ(off_, 0, PETSC_FALSE, PETSC_FALSE, &rows, &off_rows_, nullptr, &done));
      PetscCall(MatSeqAIJRestoreArray(off_, &off_values_));
    }
  }
  PetscCall(assemble(matrix_));
  PetscFunctionReturn(0);
}

}  // namespace bs
