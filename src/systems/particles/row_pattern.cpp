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
  const PetscInt d = net.dim, bs = Layout{d}.block();
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
  const PetscInt bs = Layout{net.dim}.block();
  PetscFunctionBegin;
  PetscCall(check_type(net.comm));
  PetscCall(MatCreate(net.comm, out));
  PetscCall(MatSetSizes(*out, net.n * bs, net.n * bs, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*out, bs));
  PetscCall(MatSetType(*out, MATAIJ));
  PetscCall(MatSetFromOptions(*out));
  PetscCall(preallocate(net, *out));
  PetscCall(MatSetOption(*out, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(write_zeros(net, *out));
  PetscFunctionReturn(0);
}

double RowPattern::condensed_bytes(int dim, CondensedStorage storage) const {
  const double area = dim * dim, count = static_cast<double>(blocks());
  if (storage == CondensedStorage::aij) return count * area * (sizeof(PetscScalar) + sizeof(PetscInt));
  // sbaij leaves the blocks below the diagonal out
  return (storage == CondensedStorage::sbaij ? 0.5 : 1.0) * count * (area * sizeof(MatScalar) + sizeof(PetscInt));
}

PetscErrorCode RowPattern::create_condensed(const Network& net, CondensedStorage storage, Mat* out) const {
  const PetscInt d = net.dim;
  const bool symmetric = storage == CondensedStorage::sbaij;
  PetscFunctionBegin;
  PetscCall(MatCreate(net.comm, out));
  PetscCall(MatSetSizes(*out, net.n * d, net.n * d, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*out, d));
  PetscCall(MatSetType(*out, symmetric ? MATSBAIJ : storage == CondensedStorage::baij ? MATBAIJ : MATAIJ));
  std::vector<PetscInt> off, own_upper, off_upper;
  for (PetscInt i = 0; i < net.n; ++i) {
    off.push_back(count(i) - own(i));
    own_upper.push_back(low(i) + own(i) - self(i));
    off_upper.push_back(count(i) - low(i) - own(i));
  }
  PetscCall(MatXAIJSetPreallocation(*out, d, own_.data(), off.data(), own_upper.data(), off_upper.data()));
  PetscCall(MatSetOption(*out, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  if (symmetric) PetscCall(MatSetOption(*out, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
  PetscCall(write_zeros(net, *out));
  PetscFunctionReturn(0);
}

/// Zeros in every block of the pattern, beside which A has no room from then on.
PetscErrorCode RowPattern::write_zeros(const Network& net, Mat A) const {
  PetscInt block = 0;
  RowWriter writer(net, *this);
  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(A, &block));
  const std::vector<double> zeros(static_cast<std::size_t>(widest_ * block * net.dim), 0.0);
  PetscCall(writer.begin(A));
  for (PetscInt i = 0; i < net.n; ++i)
    PetscCall(block == net.dim ? writer.write(i, net.inertia[i], zeros.data()) : writer.write(i, 0.0, 1.0, zeros.data()));
  PetscCall(writer.end());
  PetscCall(MatSetOption(A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
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

/// How PETSc gives out the arrays of a type, on one rank and on several.
struct RowWriter::Arrays {
  MatType alone, shared;
  PetscErrorCode (*parts)(Mat, Mat*, Mat*, const PetscInt**);  ///< of a shared one: its diagonal block, and the rest
  PetscErrorCode (*get)(Mat, PetscScalar**);
  PetscErrorCode (*restore)(Mat, PetscScalar**);
  enum Kind { aij, baij, sbaij } kind;
};

const RowWriter::Arrays RowWriter::ARRAYS[] = {
    {MATSEQAIJ, MATMPIAIJ, MatMPIAIJGetSeqAIJ, MatSeqAIJGetArray, MatSeqAIJRestoreArray, Arrays::aij},
    {MATSEQBAIJ, MATMPIBAIJ, MatMPIBAIJGetSeqBAIJ, MatSeqBAIJGetArray, MatSeqBAIJRestoreArray, Arrays::baij},
    {MATSEQSBAIJ, "", nullptr, MatSeqSBAIJGetArray, MatSeqSBAIJRestoreArray, Arrays::sbaij}};

PetscErrorCode RowWriter::begin(Mat A) {
  MatType type = nullptr;
  PetscInt block = 0;
  PetscBool assembled = PETSC_FALSE;
  PetscFunctionBegin;
  matrix_ = diagonal_ = A;
  off_ = nullptr;
  arrays_ = nullptr;
  PetscCall(MatAssembled(A, &assembled));
  PetscCall(MatGetBlockSize(A, &block));
  PetscCall(MatGetType(A, &type));
  const std::string name = type;
  for (const Arrays& one : ARRAYS)
    if (assembled && (name == one.alone || name == one.shared) && (one.kind == Arrays::aij || block == net_.dim)) arrays_ = &one;
  if (!arrays_) PetscFunctionReturn(0);
  if (name == arrays_->shared) PetscCall(arrays_->parts(A, &diagonal_, &off_, nullptr));
  PetscCall(arrays_->get(diagonal_, &diagonal_values_));
  if (off_) PetscCall(arrays_->get(off_, &off_values_));
  diagonal_at_ = diagonal_values_;
  off_at_ = off_values_;
  PetscFunctionReturn(0);
}

PetscErrorCode RowWriter::write(PetscInt i, double sigma, double scale, const double* panel) {
  const PetscInt d = net_.dim, bs = Layout{d}.block();
  PetscFunctionBegin;
  panel = complete_rows(net_, pattern_, i, bs, blocks_, sigma * scale, panel, &sum_);
  if (arrays_) {
    for (PetscInt k = 0; k < d; ++k) {
      *diagonal_at_++ = scale * sigma;
      *diagonal_at_++ = -scale;
    }
    write_aij(i, bs, panel);
  } else {
    PetscCall(write_generic(i, sigma, scale, panel));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode RowWriter::write(PetscInt i, double diagonal, const double* panel) {
  PetscFunctionBegin;
  panel = complete_rows(net_, pattern_, i, net_.dim, blocks_, diagonal, panel, &sum_);
  if (!arrays_) PetscCall(MatSetValuesBlocked(matrix_, 1, &net_.global[i], pattern_.count(i), pattern_.columns(i), panel, INSERT_VALUES));
  else if (arrays_->kind == Arrays::aij) write_aij(i, net_.dim, panel);
  else write_blocks(i, arrays_->kind == Arrays::baij ? pattern_.low(i) : pattern_.self(i), panel);
  PetscFunctionReturn(0);
}

// Columns of an assembled row ascend, and so do those of the pattern: each row is two or three runs of the panel.
void RowWriter::write_aij(PetscInt i, PetscInt block, const double* panel) {
  const PetscInt width = pattern_.count(i) * block, low = pattern_.low(i) * block, own = pattern_.own(i) * block;
  for (PetscInt k = 0; k < net_.dim; ++k) {
    const double* row = panel + k * width;
    std::memcpy(diagonal_at_, row + low, static_cast<std::size_t>(own) * sizeof(double));
    diagonal_at_ += own;
    if (width == own) continue;
    std::memcpy(off_at_, row, static_cast<std::size_t>(low) * sizeof(double));
    std::memcpy(off_at_ + low, row + low + own, static_cast<std::size_t>(width - low - own) * sizeof(double));
    off_at_ += width - own;
  }
}

/// Blocks are stored column by column; the owned ones from `from` on.
void RowWriter::write_blocks(PetscInt i, PetscInt from, const double* panel) {
  const PetscInt d = net_.dim, count = pattern_.count(i), width = count * d, low = pattern_.low(i), own = pattern_.own(i);
  for (PetscInt s = 0; s < count; ++s) {
    const bool mine = s >= low && s < low + own;
    if (mine && s < from) continue;
    PetscScalar*& at = mine ? diagonal_at_ : off_at_;
    for (PetscInt c = 0; c < d; ++c)
      for (PetscInt r = 0; r < d; ++r) *at++ = panel[r * width + s * d + c];
  }
}

/// Of the Jacobian, whose x rows do not have all columns of a block.
PetscErrorCode RowWriter::write_generic(PetscInt i, double sigma, double scale, const double* panel) {
  const PetscInt d = net_.dim, bs = Layout{d}.block(), width = pattern_.count(i) * bs;
  const Layout at{d};
  std::vector<PetscInt> columns;
  PetscFunctionBegin;
  for (PetscInt k = 0; k < width; ++k) columns.push_back(pattern_.columns(i)[k / bs] * bs + k % bs);
  for (PetscInt k = 0; k < d; ++k) {
    const PetscInt x_row = at.x(net_.global[i], k), v_row = at.v(net_.global[i], k), x_columns[2] = {x_row, v_row};
    const PetscScalar x_values[2] = {scale * sigma, -scale};
    PetscCall(MatSetValues(matrix_, 1, &x_row, 2, x_columns, x_values, INSERT_VALUES));
    PetscCall(MatSetValues(matrix_, 1, &v_row, width, columns.data(), panel + k * width, INSERT_VALUES));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode RowWriter::end() {
  PetscFunctionBegin;
  if (arrays_) PetscCall(arrays_->restore(diagonal_, &diagonal_values_));
  if (arrays_ && off_) PetscCall(arrays_->restore(off_, &off_values_));
  PetscCall(assemble(matrix_));
  PetscFunctionReturn(0);
}

}  // namespace bs
