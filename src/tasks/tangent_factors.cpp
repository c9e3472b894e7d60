#include "tasks/tangent_factors.hpp"
#include <algorithm>
#include <cmath>
#include <vector>

namespace bs {

PetscErrorCode TangentFactors::create(Linearisation& lin) {
  const Layout& at = lin.layout();
  double sums[2] = {0, 0};
  const PetscScalar* a = nullptr;
  PetscFunctionBegin;
  lin_ = &lin;
  PetscCall(lin.create(CondensedStorage::aij, S_.out()));
  PetscCall(lin.assemble({0, 0, 1}, false, S_));
  PetscCall(MatCreateVecs(S_, b_.out(), w_.out()));
  PetscCall(MatGetDiagonal(S_, b_));
  PetscCall(VecGetArrayRead(b_, &a));
  for (PetscInt k = 0; k < at.particles * at.dim; ++k) sums[0] += std::abs(a[k]);
  PetscCall(VecRestoreArrayRead(b_, &a));
  for (PetscInt i = 0; i < at.particles; ++i) sums[1] += at.dim * lin.masses()[static_cast<std::size_t>(i)];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, lin.comm()));
  mean_ = sums[0] / sums[1];
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::factor(double shift, bool* good) {
  PetscFunctionBegin;
  PetscCall(lin_->assemble({shift, 0, 1}, false, S_));
  PetscCall(factor_present(good));
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::factor_raised(double part, bool* good) {
  const Layout& at = lin_->layout();
  std::vector<double> size(static_cast<std::size_t>(at.particles));
  double largest = 0;
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(lin_->assemble({0, 0, 1}, false, S_));
  lin_->stiffness_sizes(size.data());
  for (const double s : size) largest = std::max(largest, s);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, lin_->comm()));
  for (double& s : size) s = s > 0 ? s : largest;  // what has no spring at all has no resistance, whatever is added
  PetscCall(VecGetArrayWrite(b_, &a));
  for (PetscInt k = 0; k < at.particles * at.dim; ++k) a[k] = part * size[static_cast<std::size_t>(k / at.dim)];
  PetscCall(VecRestoreArrayWrite(b_, &a));
  PetscCall(MatDiagonalSet(S_, b_, ADD_VALUES));
  PetscCall(factor_present(good));
  PetscFunctionReturn(0);
}

/// Of S_.
PetscErrorCode TangentFactors::factor_present(bool* good) {
  MatFactorInfo info;
  MatFactorError failed;
  PetscBool there = PETSC_FALSE;
  PetscFunctionBegin;
  *good = false;
  PetscCall(MatGetFactorAvailable(S_, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, &there));
  if (!there) PetscFunctionReturn(0);
  PetscCall(MatSetOption(S_, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(S_, MAT_SPD, PETSC_FALSE));
  PetscCall(MatGetFactor(S_, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, factors_.out()));
  PetscCall(MatMumpsSetIcntl(factors_, 24, 1));  // it counts signs only where it looks for null pivots, too,
  PetscCall(MatMumpsSetIcntl(factors_, 13, 1));  // and keeps its last front on one rank
  PetscCall(MatFactorInfoInitialize(&info));
  PetscCall(MatCholeskyFactorSymbolic(factors_, S_, nullptr, &info));
  PetscCall(MatFactorGetError(factors_, &failed));
  if (failed != MAT_FACTOR_NOERROR) PetscFunctionReturn(0);
  PetscCall(MatCholeskyFactorNumeric(factors_, S_, &info));
  PetscCall(MatFactorGetError(factors_, &failed));
  *good = failed == MAT_FACTOR_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::negative_pivots(PetscInt* count) const {
  PetscInt zero = 0, positive = 0;
  PetscFunctionBegin;
  PetscCall(MatGetInertia(factors_, count, &zero, &positive));
  PetscFunctionReturn(0);
}

PetscErrorCode TangentFactors::solve(Vec r, Vec z) {
  const Layout& at = lin_->layout();
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(r, &from));
  PetscCall(VecGetArray(b_, &to));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) to[i * at.dim + c] = from[at.v(i, c)];
  PetscCall(VecRestoreArray(b_, &to));
  PetscCall(VecRestoreArrayRead(r, &from));
  PetscCall(MatSolve(factors_, b_, w_));
  PetscCall(VecZeroEntries(z));
  PetscCall(VecGetArrayRead(w_, &from));
  PetscCall(VecGetArray(z, &to));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) to[at.x(i, c)] = from[i * at.dim + c];
  PetscCall(VecRestoreArray(z, &to));
  PetscCall(VecRestoreArrayRead(w_, &from));
  PetscFunctionReturn(0);
}

}  // namespace bs
