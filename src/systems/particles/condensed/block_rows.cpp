#include "systems/particles/condensed/block_rows.hpp"
#include <cstring>
#include "base/handle.hpp"

namespace bs {
namespace {

MatType type_of(CondensedStorage storage) {
  return storage == CondensedStorage::sbaij ? MATSBAIJ : storage == CondensedStorage::baij ? MATBAIJ : MATAIJ;
}

}  // namespace

double block_matrix_bytes(const Network& net, const RowPattern& pattern, CondensedStorage storage) {
  const double area = net.dim * net.dim, blocks = static_cast<double>(pattern.blocks());
  if (storage == CondensedStorage::aij) return blocks * area * (sizeof(PetscScalar) + sizeof(PetscInt));
  // sbaij leaves the blocks below the diagonal out
  return (storage == CondensedStorage::sbaij ? 0.5 : 1.0) * blocks * (area * sizeof(MatScalar) + sizeof(PetscInt));
}

PetscErrorCode create_block_matrix(const Network& net, const RowPattern& pattern, CondensedStorage storage, Mat* out) {
  const PetscInt d = net.dim;
  PetscFunctionBegin;
  PetscCall(MatCreate(net.comm, out));
  PetscCall(MatSetSizes(*out, net.n * d, net.n * d, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*out, d));
  PetscCall(MatSetType(*out, type_of(storage)));
  std::vector<PetscInt> own, off, own_upper, off_upper;
  for (PetscInt i = 0; i < net.n; ++i) {
    own.push_back(pattern.own(i));
    off.push_back(pattern.count(i) - pattern.own(i));
    own_upper.push_back(pattern.low(i) + pattern.own(i) - pattern.self(i));
    off_upper.push_back(pattern.count(i) - pattern.low(i) - pattern.own(i));
  }
  PetscCall(MatXAIJSetPreallocation(*out, d, own.data(), off.data(), own_upper.data(), off_upper.data()));
  PetscCall(MatSetOption(*out, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  if (storage == CondensedStorage::sbaij) PetscCall(MatSetOption(*out, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
  BlockRowWriter writer(net, pattern);
  const std::vector<double> zeros(static_cast<std::size_t>(pattern.widest() * d * d), 0.0);
  PetscCall(writer.begin(*out));
  for (PetscInt i = 0; i < net.n; ++i) PetscCall(writer.write(i, zeros.data()));
  PetscCall(writer.end());
  PetscCall(MatSetOption(*out, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode BlockRowWriter::begin(Mat S) {
  MatType type = nullptr;
  PetscBool assembled = PETSC_FALSE;
  PetscFunctionBegin;
  matrix_ = S;
  diagonal_ = S;
  off_ = nullptr;
  way_ = Way::generic;
  PetscCall(MatAssembled(S, &assembled));
  if (!assembled) PetscFunctionReturn(0);
  PetscCall(MatGetType(S, &type));
  const std::string name = type;
  if (name == MATSEQAIJ || name == MATMPIAIJ) {
    if (name == MATMPIAIJ) PetscCall(MatMPIAIJGetSeqAIJ(S, &diagonal_, &off_, nullptr));
    PetscCall(MatSeqAIJGetArray(diagonal_, &diagonal_values_));
    if (off_) PetscCall(MatSeqAIJGetArray(off_, &off_values_));
    way_ = Way::aij;
  } else if (name == MATSEQBAIJ || name == MATMPIBAIJ) {
    if (name == MATMPIBAIJ) PetscCall(MatMPIBAIJGetSeqBAIJ(S, &diagonal_, &off_, nullptr));
    PetscCall(MatSeqBAIJGetArray(diagonal_, &diagonal_values_));
    if (off_) PetscCall(MatSeqBAIJGetArray(off_, &off_values_));
    way_ = Way::baij;
  } else if (name == MATSEQSBAIJ) {
    PetscCall(MatSeqSBAIJGetArray(S, &diagonal_values_));
    way_ = Way::sbaij;
  }
  diagonal_at_ = diagonal_values_;
  off_at_ = off_values_;
  PetscFunctionReturn(0);
}

PetscErrorCode BlockRowWriter::write(PetscInt i, const double* panel) {
  PetscFunctionBegin;
  const double diagonal = (inertia_ > 0 ? inertia_ : 1) * net_.inertia[i];
  panel = complete_rows(net_, pattern_, i, net_.dim, blocks_, diagonal, panel, &sum_);
  switch (way_) {
    case Way::aij: write_aij(i, panel); break;
    case Way::baij: write_blocks(i, pattern_.low(i), panel); break;
    case Way::sbaij: write_blocks(i, pattern_.self(i), panel); break;
    case Way::generic: PetscCall(write_generic(i, panel)); break;
  }
  PetscFunctionReturn(0);
}

// Columns of an assembled row ascend, and so do those of the pattern: each row is two or three runs of the panel.
void BlockRowWriter::write_aij(PetscInt i, const double* panel) {
  const PetscInt d = net_.dim, width = pattern_.count(i) * d, low = pattern_.low(i) * d, own = pattern_.own(i) * d;
  for (PetscInt k = 0; k < d; ++k) {
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
void BlockRowWriter::write_blocks(PetscInt i, PetscInt from, const double* panel) {
  const PetscInt d = net_.dim, count = pattern_.count(i), width = count * d, low = pattern_.low(i), own = pattern_.own(i);
  for (PetscInt s = 0; s < count; ++s) {
    const bool mine = s >= low && s < low + own;
    if (mine && s < from) continue;
    PetscScalar*& at = mine ? diagonal_at_ : off_at_;
    for (PetscInt c = 0; c < d; ++c)
      for (PetscInt r = 0; r < d; ++r) *at++ = panel[r * width + s * d + c];
  }
}

PetscErrorCode BlockRowWriter::write_generic(PetscInt i, const double* panel) {
  PetscFunctionBegin;
  PetscCall(MatSetValuesBlocked(matrix_, 1, &net_.global[i], pattern_.count(i), pattern_.columns(i), panel, INSERT_VALUES));
  PetscFunctionReturn(0);
}

PetscErrorCode BlockRowWriter::end() {
  PetscFunctionBegin;
  if (way_ == Way::aij) {
    PetscCall(MatSeqAIJRestoreArray(diagonal_, &diagonal_values_));
    if (off_) PetscCall(MatSeqAIJRestoreArray(off_, &off_values_));
  } else if (way_ == Way::baij) {
    PetscCall(MatSeqBAIJRestoreArray(diagonal_, &diagonal_values_));
    if (off_) PetscCall(MatSeqBAIJRestoreArray(off_, &off_values_));
  } else if (way_ == Way::sbaij) {
    PetscCall(MatSeqSBAIJRestoreArray(diagonal_, &diagonal_values_));
  }
  PetscCall(assemble(matrix_));
  PetscFunctionReturn(0);
}

}  // namespace bs
