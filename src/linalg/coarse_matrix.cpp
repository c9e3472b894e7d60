#include "linalg/coarse_matrix.hpp"
#include <petscksp.h>
#include <algorithm>
#include "base/collective.hpp"
#include "base/handle.hpp"

#if !defined(PETSC_HAVE_SUITESPARSE)
#error "the coarse grid is factored by CHOLMOD: configure PETSc with --download-suitesparse"
#endif

namespace bs {

void CoarseMatrix::create(PetscInt nodes, int width, int stride) {
  width_ = width;
  stride_ = stride;
  rows_.assign(static_cast<std::size_t>(nodes), {});
  numbers_.clear();
  for (PetscInt a = 0; a < nodes; ++a) place(a, a);
}

std::size_t CoarseMatrix::place(PetscInt a, PetscInt b) {
  std::vector<Entry>& row = rows_[static_cast<std::size_t>(a)];
  for (const Entry& e : row)
    if (e.column == b) return e.place;
  row.push_back({b, numbers_.size()});
  numbers_.resize(numbers_.size() + static_cast<std::size_t>(width_ * stride_), 0.0);
  return row.back().place;
}

PetscErrorCode CoarseMatrix::sum(MPI_Comm comm) {
  const std::size_t area = static_cast<std::size_t>(width_ * stride_);
  std::vector<double> own, all;  // row, column, numbers
  PetscFunctionBegin;
  if (size_of(comm) == 1) PetscFunctionReturn(0);
  for (std::size_t a = 0; a < rows_.size(); ++a)
    for (const Entry& e : rows_[a]) {
      const double* from = numbers(e.place);
      if (std::all_of(from, from + area, [](double x) { return x == 0; })) continue;
      own.push_back(static_cast<double>(a));
      own.push_back(static_cast<double>(e.column));
      own.insert(own.end(), from, from + area);
    }
  PetscCall(gather_all(comm, own, &all));
  create(static_cast<PetscInt>(rows_.size()), width_, stride_);
  for (std::size_t k = 0; k < all.size(); k += 2 + area) {
    double* to = numbers(place(static_cast<PetscInt>(all[k]), static_cast<PetscInt>(all[k + 1])));
    for (std::size_t m = 0; m < area; ++m) to[m] += all[k + 2 + m];
  }
  PetscFunctionReturn(0);
}

/// The matrix and its order of elimination are kept where its blocks are those of before.
PetscErrorCode CoarseMatrix::set_pattern() {
  std::vector<PetscInt> pattern, entries;
  PetscFunctionBegin;
  for (std::vector<Entry>& row : rows_) {
    std::sort(row.begin(), row.end(), [](const Entry& one, const Entry& other) { return one.column < other.column; });
    for (const Entry& e : row) pattern.push_back(e.column);
    pattern.push_back(-1);
    for (int r = 0; r < width_; ++r) entries.push_back(static_cast<PetscInt>(row.size()) * width_ - r);
  }
  if (E_ && pattern == pattern_) PetscFunctionReturn(0);
  pattern_ = std::move(pattern);
  factors_.reset();
  PetscCall(MatCreateSeqSBAIJ(PETSC_COMM_SELF, 1, unknowns(), unknowns(), 0, entries.data(), E_.out()));
  PetscCall(MatSetOption(E_, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
  PetscCall(MatCreateVecs(E_, in_.out(), out_.out()));
  PetscFunctionReturn(0);
}

// DISTINCT is added to the diagonal, relatively, where held components make motions of a group depend on each other: more than rounding, far less
// than the softest motion of all.
PetscErrorCode CoarseMatrix::set_values() {
  constexpr double DISTINCT = 1e-12;
  std::vector<PetscInt> columns(static_cast<std::size_t>(width_));
  PetscFunctionBegin;
  PetscCall(MatZeroEntries(E_));
  for (std::size_t a = 0; a < rows_.size(); ++a)
    for (const Entry& e : rows_[a]) {
      const bool diagonal = e.column == static_cast<PetscInt>(a);
      for (int c = 0; c < width_; ++c) columns[static_cast<std::size_t>(c)] = e.column * width_ + c;
      for (int r = 0; r < width_; ++r) {
        const PetscInt row = static_cast<PetscInt>(a) * width_ + r;
        double* from = numbers(e.place) + r * stride_;
        if (diagonal) from[r] = from[r] == 0 ? 1 : (1 + DISTINCT) * from[r];
        PetscCall(MatSetValues(E_, 1, &row, width_, columns.data(), from, INSERT_VALUES));
      }
    }
  PetscCall(assemble(E_));
  PetscFunctionReturn(0);
}

// CHOLMOD's supernodal factors tell that E is not positive definite by an error (zero pivot), its others not at all; and it prints a warning unless
// it is told not to.
PetscErrorCode CoarseMatrix::set_up(const char* package, bool* done) {
  PetscOptions own;
  PetscErrorCode failed;
  PCFailedReason reason = PC_NOERROR;
  PetscFunctionBegin;
  PetscCall(PetscOptionsCreate(&own));
  PetscCall(PetscOptionsSetValue(own, "-mat_cholmod_factor", "SUPERNODAL"));
  PetscCall(PetscOptionsSetValue(own, "-mat_cholmod_print", "0"));
  PetscCall(PetscOptionsPush(own));
  if (!factors_ || package != package_) {
    PetscCall(PCCreate(PETSC_COMM_SELF, factors_.out()));
    PetscCall(PCSetType(factors_, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(factors_, package));
  }
  package_ = package;
  PetscCall(PCSetOperators(factors_, E_, E_));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
  failed = PCSetUp(factors_);
  PetscCall(PetscPopErrorHandler());
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&own));
  if (failed != PETSC_ERR_MAT_CH_ZRPVT) PetscCall(failed);
  if (!failed) PetscCall(PCGetFailedReason(factors_, &reason));
  *done = !failed && reason == PC_NOERROR;
  if (!*done) factors_.reset();
  PetscFunctionReturn(0);
}

// CHOLMOD's solves take half the time of MUMPS'.
PetscErrorCode CoarseMatrix::factor(MPI_Comm comm, bool* definite, bool* factored) {
  PetscFunctionBegin;
  PetscCall(sum(comm));
  PetscCall(set_pattern());
  PetscCall(set_values());
  PetscCall(set_up(MATSOLVERCHOLMOD, definite));
  *factored = *definite;
  if (!*factored) PetscCall(set_up(MATSOLVERMUMPS, factored));
  int both[2] = {*definite, *factored};
  PetscCall(min_over_ranks(comm, both, 2));  // ranks on unlike processors may round differently
  *definite = both[0] != 0;
  *factored = both[1] != 0;
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseMatrix::solve(const double* in, double* out) {
  PetscFunctionBegin;
  PetscCall(VecPlaceArray(in_, in));
  PetscCall(VecPlaceArray(out_, out));
  PetscCall(PCApply(factors_, in_, out_));
  PetscCall(VecResetArray(in_));
  PetscCall(VecResetArray(out_));
  PetscFunctionReturn(0);
}

}  // namespace bs
