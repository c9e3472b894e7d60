#include "linalg/coarse_factors.hpp"
#include <algorithm>
#include "base/collective.hpp"

#if !defined(PETSC_HAVE_SUITESPARSE)
#error "the coarse grid is factored by CHOLMOD: configure PETSc with --download-suitesparse"
#endif

namespace bs {

void CoarseBlocks::create(PetscInt nodes, std::vector<PetscInt> differences, std::size_t width) {
  nodes_ = nodes;
  width_ = width;
  difference_ = std::move(differences);
  slot_.assign(difference_.empty() ? 0 : static_cast<std::size_t>(difference_.back()) + 1, -1);
  for (std::size_t k = 0; k < difference_.size(); ++k) slot_[static_cast<std::size_t>(difference_[k])] = static_cast<PetscInt>(k);
  near_.assign(static_cast<std::size_t>(nodes) * difference_.size() * width, 0.0);
  far_.clear();
}

double* CoarseBlocks::far(PetscInt a, PetscInt b) {
  std::vector<double>& numbers = far_[{a, b}];
  if (numbers.empty()) numbers.assign(width_, 0.0);
  return numbers.data();
}

PetscErrorCode CoarseBlocks::sum(MPI_Comm comm) {
  PetscFunctionBegin;
  PetscCall(sum_over_ranks(comm, near_.data(), near_.size()));
  PetscCall(sum_far(comm));
  PetscFunctionReturn(0);
}

/// Every rank gets all far blocks and adds them in the order of the ranks.
PetscErrorCode CoarseBlocks::sum_far(MPI_Comm comm) {
  PetscMPIInt ranks;
  std::vector<double> own, all;  // ends, numbers
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  if (ranks == 1) PetscFunctionReturn(0);
  for (const auto& [ends, numbers] : far_) {
    own.push_back(static_cast<double>(ends.first));
    own.push_back(static_cast<double>(ends.second));
    own.insert(own.end(), numbers.begin(), numbers.end());
  }
  PetscCall(gather_all(comm, own, &all));
  far_.clear();
  for (std::size_t k = 0; k < all.size(); k += 2 + width_) {
    double* to = far(static_cast<PetscInt>(all[k]), static_cast<PetscInt>(all[k + 1]));
    for (std::size_t m = 0; m < width_; ++m) to[m] += all[k + 2 + m];
  }
  PetscFunctionReturn(0);
}

/// Blocks of E, each once; the matrix and its order of elimination are kept where they are those of before.
PetscErrorCode CoarseFactors::set_pattern(int d, const CoarseBlocks& blocks, const CoarseBlocks& full) {
  const PetscInt size = blocks.nodes() * d;
  std::vector<std::pair<PetscInt, PetscInt>> pattern;
  PetscFunctionBegin;
  const auto note = [&](PetscInt a, PetscInt b, const double*) { pattern.emplace_back(a, b); };
  for (PetscInt a = 0; a < blocks.nodes(); ++a) pattern.emplace_back(a, a);
  blocks.for_each(note);
  full.for_each(note);
  std::sort(pattern.begin(), pattern.end());
  pattern.erase(std::unique(pattern.begin(), pattern.end()), pattern.end());
  if (E_ && pattern == pattern_) PetscFunctionReturn(0);
  pattern_ = std::move(pattern);
  std::vector<PetscInt> entries(static_cast<std::size_t>(size), 0);
  for (const auto& [a, b] : pattern_)
    for (int r = 0; r < d; ++r) entries[static_cast<std::size_t>(a * d + r)] += a == b ? d - r : d;
  factors_.reset();
  PetscCall(MatCreateSeqSBAIJ(PETSC_COMM_SELF, 1, size, size, 0, entries.data(), E_.out()));
  PetscCall(MatSetOption(E_, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
  PetscCall(MatCreateVecs(E_, in_.out(), out_.out()));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseFactors::set_values(int d, const CoarseBlocks& blocks, const CoarseBlocks& full) {
  PetscErrorCode failed = 0;
  double whole[9];
  PetscInt rows[3], columns[3];
  std::vector<double> diagonal(static_cast<std::size_t>(blocks.nodes() * d), 0.0);
  PetscFunctionBegin;
  const auto add = [&](PetscInt a, PetscInt b, const double* numbers) {
    for (int c = 0; c < d; ++c) {
      rows[c] = a * d + c;
      columns[c] = b * d + c;
      if (a == b) diagonal[static_cast<std::size_t>(rows[c])] += numbers[c * (d + 1)];
    }
    if (!failed) failed = MatSetValues(E_, d, rows, d, columns, numbers, ADD_VALUES);
  };
  PetscCall(MatZeroEntries(E_));
  blocks.for_each([&](PetscInt a, PetscInt b, const double* numbers) {
    for (int r = 0, k = 0; r < d; ++r)
      for (int c = r; c < d; ++c, ++k) whole[r * d + c] = whole[c * d + r] = numbers[k];
    add(a, b, whole);
  });
  full.for_each(add);
  PetscCall(failed);
  for (PetscInt k = 0; k < blocks.nodes() * d; ++k)  // no point is near a node without entries
    PetscCall(MatSetValue(E_, k, k, diagonal[static_cast<std::size_t>(k)] == 0 ? 1 : 0, ADD_VALUES));
  PetscCall(MatAssemblyBegin(E_, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(E_, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

// CHOLMOD's solves take half the time of MUMPS' here. Its supernodal factors tell that E is not positive definite by an error (zero pivot),
// its others not at all; and it prints a warning unless it is told not to.
PetscErrorCode CoarseFactors::factor(bool* definite) {
  PetscOptions own;
  PetscErrorCode failed;
  PetscFunctionBegin;
  PetscCall(PetscOptionsCreate(&own));
  PetscCall(PetscOptionsSetValue(own, "-mat_cholmod_factor", "SUPERNODAL"));
  PetscCall(PetscOptionsSetValue(own, "-mat_cholmod_print", "0"));
  PetscCall(PetscOptionsPush(own));
  if (!factors_) {
    PetscCall(PCCreate(PETSC_COMM_SELF, factors_.out()));
    PetscCall(PCSetType(factors_, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(factors_, MATSOLVERCHOLMOD));
  }
  PetscCall(PCSetOperators(factors_, E_, E_));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
  failed = PCSetUp(factors_);
  PetscCall(PetscPopErrorHandler());
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&own));
  if (failed) factors_.reset();
  *definite = failed != PETSC_ERR_MAT_CH_ZRPVT;
  if (*definite) PetscCall(failed);
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseFactors::create(int d, const CoarseBlocks& blocks, const CoarseBlocks& full, bool* definite) {
  PetscFunctionBegin;
  PetscCall(set_pattern(d, blocks, full));
  PetscCall(set_values(d, blocks, full));
  PetscCall(factor(definite));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseFactors::solve(const double* in, double* out) {
  PetscFunctionBegin;
  PetscCall(VecPlaceArray(in_, in));
  PetscCall(VecPlaceArray(out_, out));
  PetscCall(PCApply(factors_, in_, out_));
  PetscCall(VecResetArray(in_));
  PetscCall(VecResetArray(out_));
  PetscFunctionReturn(0);
}

}  // namespace bs
