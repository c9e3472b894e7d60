#include "linalg/eigen/standard_form.hpp"
#include <cmath>
#include "base/collective.hpp"
#include "base/petsc_versions.hpp"
#include "base/vec_array.hpp"

namespace bs {

PetscErrorCode StandardForm::create(Pencil& linearised) {
  const PetscInt n = linearised.points(), d = linearised.dim();
  const std::vector<double>& m = linearised.masses();
  PetscFunctionBegin;
  lin_ = &linearised;
  at_.clear();
  root_.clear();
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt c = 0; c < d; ++c) {
      if (!linearised.moves(i, c)) continue;
      at_.push_back(i * d + c);
      root_.push_back(std::sqrt(m[static_cast<std::size_t>(i)]));
    }
  total_ = static_cast<PetscInt>(at_.size());
  PetscCall(sum_over_ranks(comm(), &total_));
  PetscCall(create_full(full_.out()));
  PetscCall(create_full(other_.out()));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::create_vector(Vec* u) const {
  PetscFunctionBegin;
  PetscCall(VecCreate(comm(), u));
  PetscCall(VecSetSizes(*u, static_cast<PetscInt>(at_.size()), total_));
  PetscCall(VecSetType(*u, VECSTANDARD));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::create_full(Vec* z) const {
  PetscFunctionBegin;
  PetscCall(create_vec(comm(), lin_->points(), lin_->dim(), z));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::shape(Vec u, Vec q) const {
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(q));
  const ReadArray from(u);
  const WriteArray to(q);
  for (std::size_t k = 0; k < at_.size(); ++k) to[at_[k]] = from[k] / root_[k];
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::weigh(Vec q, Vec u) const {
  PetscFunctionBegin;
  const ReadArray from(q);
  const WriteArray to(u);
  for (std::size_t k = 0; k < at_.size(); ++k) to[k] = from[at_[k]] * root_[k];
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::multiply(Vec u, Vec v) {
  PetscFunctionBegin;
  PetscCall(shape(u, full_));
  PetscCall(lin_->multiply({0, 0, 1}, full_, other_));
  PetscCall(weigh_force(v));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::multiply_stored(Vec u, Vec v) {
  PetscFunctionBegin;
  PetscCall(shape(u, full_));
  PetscCall(MatMult(stored_, full_, other_));
  PetscCall(weigh_force(v));
  PetscFunctionReturn(0);
}

/// v = M^-1/2 f of the force in other_.
PetscErrorCode StandardForm::weigh_force(Vec v) const {
  PetscFunctionBegin;
  const ReadArray from(other_);
  const WriteArray to(v);
  for (std::size_t k = 0; k < at_.size(); ++k) to[k] = from[at_[k]] / root_[k];
  PetscFunctionReturn(0);
}

static PetscErrorCode shell_multiply(Mat A, Vec u, Vec v) {
  StandardForm* self = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(A, &self));
  PetscCall(self->multiply_stored(u, v));
  PetscFunctionReturn(0);
}

static PetscErrorCode shell_diagonal(Mat A, Vec out) {
  StandardForm* self = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(A, &self));
  PetscCall(self->diagonal(out));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::create_operator(Mat* A) {
  const PetscInt local = static_cast<PetscInt>(at_.size());
  PetscFunctionBegin;
  PetscCall(lin_->create(CondensedStorage::sbaij, stored_.out()));
  PetscCall(lin_->assemble({0, 0, 1}, false, stored_));
  PetscCall(MatCreateShell(comm(), local, local, total_, total_, this, A));
  PetscCall(MatSetVecType(*A, VECSTANDARD));
  PetscCall(set_shell_operation(*A, MATOP_MULT, shell_multiply));
  PetscCall(set_shell_operation(*A, MATOP_MULT_TRANSPOSE, shell_multiply));
  PetscCall(set_shell_operation(*A, MATOP_GET_DIAGONAL, shell_diagonal));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::assemble(Mat* A) const {
  MatHandle S;
  VecHandle scale;
  PetscScalar* a = nullptr;
  PetscInt first = 0;
  PetscFunctionBegin;
  PetscCall(lin_->create(CondensedStorage::aij, S.out()));
  PetscCall(lin_->assemble({0, 0, 1}, false, S));
  PetscCall(MatSetNearNullSpace(S, nullptr));
  PetscCall(MatGetOwnershipRange(S, &first, nullptr));
  if (total_ == lin_->unknowns()) {
    PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(S.get())));
    *A = S;
  } else {
    std::vector<PetscInt> rows;
    for (const PetscInt k : at_) rows.push_back(first + k);
    ISHandle kept;
    PetscCall(ISCreateGeneral(comm(), static_cast<PetscInt>(rows.size()), rows.data(), PETSC_COPY_VALUES, kept.out()));
    PetscCall(MatCreateSubMatrix(S, kept, kept, MAT_INITIAL_MATRIX, A));
  }
  PetscCall(create_vector(scale.out()));
  PetscCall(VecGetArrayWrite(scale, &a));
  for (std::size_t k = 0; k < root_.size(); ++k) a[k] = 1 / root_[k];
  PetscCall(VecRestoreArrayWrite(scale, &a));
  PetscCall(MatDiagonalScale(*A, scale, scale));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::create_springs() {
  PetscFunctionBegin;
  if (!springs_) PetscCall(lin_->create(CondensedStorage::springs, springs_.out()));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::diagonal(Vec out) {
  PetscFunctionBegin;
  PetscCall(create_springs());
  if (!inverse_) PetscCall(lin_->assemble({0, 0, 1}, false, springs_));
  PetscCall(MatGetDiagonal(springs_, other_));
  const ReadArray from(other_);
  const WriteArray to(out);
  for (std::size_t k = 0; k < at_.size(); ++k) to[k] = from[at_[k]] / (root_[k] * root_[k]);
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::sizes(Vec s) const {
  const PetscInt d = lin_->dim();
  std::vector<double> size(static_cast<std::size_t>(lin_->points()));
  PetscFunctionBegin;
  lin_->stiffness_sizes(size.data());
  const WriteArray to(s);
  for (std::size_t k = 0; k < at_.size(); ++k) to[k] = size[static_cast<std::size_t>(at_[k] / d)] / (root_[k] * root_[k]);
  PetscFunctionReturn(0);
}

void StandardForm::release_matrices() {
  inverse_.reset();
  springs_.reset();
  stored_.reset();
}

/// z = M^1/2 P^-1 M^1/2 r
PetscErrorCode apply_inverse(PC pc, Vec r, Vec z) {
  StandardForm* self = nullptr;
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;
  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &self));
  PetscCall(VecZeroEntries(self->full_));
  PetscCall(VecGetArrayRead(r, &from));
  PetscCall(VecGetArray(self->full_, &to));
  for (std::size_t k = 0; k < self->at_.size(); ++k) to[self->at_[k]] = from[k] * self->root_[k];
  PetscCall(VecRestoreArray(self->full_, &to));
  PetscCall(VecRestoreArrayRead(r, &from));
  PetscCall(PCApply(self->inverse_, self->full_, self->other_));
  PetscCall(self->weigh(self->other_, z));
  PetscFunctionReturn(0);
}

PetscErrorCode StandardForm::create_preconditioner(double shift, PC pc) {
  PetscFunctionBegin;
  PetscCall(create_springs());
  PetscCall(lin_->assemble({shift, 0, 1}, true, springs_));
  PetscCall(PCCreate(comm(), inverse_.out()));
  PetscCall(PCSetOptionsPrefix(inverse_, "modes_"));
  PetscCall(PCSetOperators(inverse_, springs_, springs_));
  PetscCall(PCSetType(inverse_, "bicc"));
  PetscCall(PCSetFromOptions(inverse_));
  PetscCall(PCSetUp(inverse_));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, this));
  PetscCall(PCShellSetApply(pc, apply_inverse));
  PetscCall(PCShellSetName(pc, "bicc"));
  PetscFunctionReturn(0);
}

}  // namespace bs
