#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/disjoint_sets.hpp"
#include "base/handle.hpp"
#include "systems/linear/system.hpp"

namespace bs {
namespace {

constexpr PetscInt MOST_STATES = 100000, MOST_COUPLED = 300;
constexpr double MOST_WORK = 1e9;  // sum of the cubes of the blocks' sizes: about a second

/// The whole matrix on this rank.
PetscErrorCode gather(Mat A, MatHandle* whole) {
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(PetscObjectComm(reinterpret_cast<PetscObject>(A)));
  PetscCall(MatCreateRedundantMatrix(A, size, MPI_COMM_NULL, MAT_INITIAL_MATRIX, whole->out()));
  PetscFunctionReturn(0);
}

/// A = U diag(s) V' of an m x n matrix by columns; U and V whole, s descending, min(m, n) of them.
struct Decomposition {
  std::vector<double> u, s, vt;
  bool of(std::vector<double> a, PetscInt rows, PetscInt columns) {
    const PetscInt least = std::min(rows, columns), most = std::max(rows, columns);
    PetscBLASInt m = static_cast<PetscBLASInt>(rows), n = static_cast<PetscBLASInt>(columns), info = 0;
    PetscBLASInt lwork = static_cast<PetscBLASInt>(5 * most + 3 * least + 64);
    u.assign(static_cast<std::size_t>(rows * rows), 0);
    vt.assign(static_cast<std::size_t>(columns * columns), 0);
    s.assign(static_cast<std::size_t>(least), 0);
    std::vector<double> work(static_cast<std::size_t>(lwork));
    LAPACKgesvd_("A", "A", &m, &n, a.data(), &m, s.data(), u.data(), &m, vt.data(), &n, work.data(), &lwork, &info);
    return info == 0;
  }
};

/// Rows and columns that C's nonzeros connect.
struct Block {
  std::vector<PetscInt> rows, columns;
};

PetscErrorCode blocks_of(Mat C, PetscInt n, std::vector<Block>* out) {
  PetscFunctionBegin;
  DisjointSets joined(2 * n);  // rows, then columns
  for (PetscInt i = 0; i < n; ++i) PetscCall(each_nonzero(C, i, [&](PetscInt j, double) { joined.join(i, n + j); }));
  std::vector<PetscInt> number(static_cast<std::size_t>(2 * n), -1);
  for (PetscInt k = 0; k < 2 * n; ++k) {
    PetscInt& mine = number[joined.top(k)];
    if (mine < 0) {
      mine = static_cast<PetscInt>(out->size());
      out->emplace_back();
    }
    if (k < n) (*out)[mine].rows.push_back(k);
    else (*out)[mine].columns.push_back(k - n);
  }
  PetscFunctionReturn(0);
}

/// Adds the null vectors of one block with rows and columns scaled to a largest entry of 1; `known` false: it has no decomposition.
PetscErrorCode add_null_vectors(Mat C, const Block& block, std::vector<SparseVector>* left, std::vector<SparseVector>* right, bool* known) {
  const PetscInt r = static_cast<PetscInt>(block.rows.size()), c = static_cast<PetscInt>(block.columns.size());
  PetscFunctionBegin;
  if (r == 1 && c == 1) PetscFunctionReturn(0);
  if (r == 0 || c == 0) {
    for (const PetscInt i : block.rows) left->push_back({{i}, {1.0}});
    for (const PetscInt j : block.columns) right->push_back({{j}, {1.0}});
    PetscFunctionReturn(0);
  }
  std::vector<double> a(static_cast<std::size_t>(r * c), 0), of_row(static_cast<std::size_t>(r), 0), of_column(static_cast<std::size_t>(c), 0);
  for (PetscInt i = 0; i < r; ++i)
    PetscCall(each_nonzero(C, block.rows[i], [&](PetscInt j, double value) {
      const auto at = std::lower_bound(block.columns.begin(), block.columns.end(), j) - block.columns.begin();
      a[static_cast<std::size_t>(at * r + i)] = value;
      of_row[i] = std::max(of_row[i], std::abs(value));
    }));
  for (PetscInt j = 0; j < c; ++j) {
    for (PetscInt i = 0; i < r; ++i) of_column[j] = std::max(of_column[j], std::abs(a[j * r + i] /= of_row[i]));
    for (PetscInt i = 0; i < r; ++i) a[j * r + i] /= of_column[j];
  }
  Decomposition d;
  *known = d.of(std::move(a), r, c);
  if (!*known) PetscFunctionReturn(0);
  const double zero = 32 * PETSC_MACHINE_EPSILON * static_cast<double>(std::max(r, c)) * d.s[0];
  const PetscInt rank = static_cast<PetscInt>(std::count_if(d.s.begin(), d.s.end(), [&](double s) { return s > zero; }));
  for (PetscInt k = rank; k < r; ++k) {
    left->push_back({block.rows, {}});
    for (PetscInt i = 0; i < r; ++i) left->back().value.push_back(d.u[k * r + i] / of_row[i]);
  }
  for (PetscInt k = rank; k < c; ++k) {
    right->push_back({block.columns, {}});
    for (PetscInt j = 0; j < c; ++j) right->back().value.push_back(d.vt[j * c + k] / of_column[j]);
  }
  PetscFunctionReturn(0);
}

void scale_to_one(SparseVector* v) {
  double most = 0;
  for (const double value : v->value) most = std::max(most, std::abs(value));
  for (double& value : v->value) value /= most;
}

/// W'G N, rows scaled to a largest entry of 1; `empty`: a row or a column has no entries above the rounding of its terms.
PetscErrorCode project(Mat G, PetscInt n, const std::vector<SparseVector>& left, const std::vector<SparseVector>& right, MatHandle* S, bool* empty) {
  const PetscInt m = static_cast<PetscInt>(left.size());
  PetscFunctionBegin;
  std::vector<std::vector<std::pair<PetscInt, double>>> at(static_cast<std::size_t>(n));  // by state: null vectors that hold it
  for (PetscInt k = 0; k < m; ++k)
    for (std::size_t e = 0; e < right[k].at.size(); ++e) at[right[k].at[e]].push_back({k, right[k].value[e]});
  PetscCall(MatCreate(PETSC_COMM_SELF, S->out()));
  PetscCall(MatSetSizes(*S, m, m, m, m));
  PetscCall(MatSetType(*S, MATSEQAIJ));
  PetscCall(MatSetUp(*S));
  PetscCall(MatSetOption(*S, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  std::vector<double> sum(static_cast<std::size_t>(m), 0), size(static_cast<std::size_t>(m), 0);
  std::vector<bool> met(static_cast<std::size_t>(m), false);
  for (PetscInt k = 0; k < m; ++k) {
    std::vector<PetscInt> touched;
    for (std::size_t e = 0; e < left[k].at.size(); ++e)
      PetscCall(each_nonzero(G, left[k].at[e], [&](PetscInt j, double value) {
        for (const auto& [column, part] : at[j]) {
          if (size[column] == 0) touched.push_back(column);
          sum[column] += left[k].value[e] * value * part;
          size[column] += std::abs(left[k].value[e] * value * part);
        }
      }));
    double most = 0;
    for (const PetscInt j : touched) {
      if (std::abs(sum[j]) <= 1e-13 * size[j]) sum[j] = 0;  // cancelled but for rounding
      most = std::max(most, std::abs(sum[j]));
    }
    if (most == 0) *empty = true;
    for (const PetscInt j : touched) {
      if (sum[j] != 0) {
        met[j] = true;
        PetscCall(MatSetValue(*S, k, j, sum[j] / most, INSERT_VALUES));
      }
      sum[j] = size[j] = 0;
    }
  }
  if (std::find(met.begin(), met.end(), false) != met.end()) *empty = true;
  PetscCall(assemble(*S));
  PetscFunctionReturn(0);
}

/// The rows of the system with the largest part in the left singular vector of S that belongs to its smallest singular value.
PetscErrorCode name_rows(Mat S, const std::vector<SparseVector>& left, std::vector<PetscInt>* rows) {
  const PetscInt m = static_cast<PetscInt>(left.size());
  PetscFunctionBegin;
  if (m > MOST_COUPLED) PetscFunctionReturn(0);
  std::vector<double> a(static_cast<std::size_t>(m * m), 0);
  for (PetscInt i = 0; i < m; ++i) PetscCall(each_nonzero(S, i, [&](PetscInt j, double value) { a[static_cast<std::size_t>(j * m + i)] = value; }));
  Decomposition d;
  if (!d.of(std::move(a), m, m)) PetscFunctionReturn(0);
  std::vector<std::pair<double, PetscInt>> part;
  double most = 0;
  for (PetscInt k = 0; k < m; ++k)
    for (std::size_t e = 0; e < left[k].at.size(); ++e) {
      part.push_back({std::abs(d.u[(m - 1) * m + k] * left[k].value[e]), left[k].at[e]});
      most = std::max(most, part.back().first);
    }
  std::stable_sort(part.begin(), part.end(), [](const auto& one, const auto& other) { return one.first > other.first; });
  for (std::size_t k = 0; k < part.size() && k < 3 && part[k].first > 0.1 * most; ++k) rows->push_back(part[k].second);
  std::sort(rows->begin(), rows->end());
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode find_null_spaces(Mat C, NullSpaces* out) {
  PetscInt n;
  double work = 0;
  PetscFunctionBegin;
  PetscCall(MatGetSize(C, &n, nullptr));
  if (n > MOST_STATES) PetscFunctionReturn(0);
  MatHandle all_C;
  PetscCall(gather(C, &all_C));
  std::vector<Block> blocks;
  PetscCall(blocks_of(all_C, n, &blocks));
  for (const Block& block : blocks) {
    const double size = static_cast<double>(std::max(block.rows.size(), block.columns.size()));
    if (block.rows.empty() || block.columns.empty()) continue;
    work += size > 1 ? size * size * size : 0;
    if (size > MOST_COUPLED || work > MOST_WORK) PetscFunctionReturn(0);
  }
  bool known = true;
  for (const Block& block : blocks) {
    PetscCall(add_null_vectors(all_C, block, &out->left, &out->right, &known));
    if (!known) PetscFunctionReturn(0);
  }
  for (SparseVector& v : out->left) scale_to_one(&v);
  for (SparseVector& v : out->right) scale_to_one(&v);
  out->known = true;
  PetscFunctionReturn(0);
}

PetscErrorCode find_index(Mat G, const NullSpaces& of_C, PencilIndex* out) {
  const std::vector<SparseVector>&left = of_C.left, &right = of_C.right;
  PetscInt n;
  bool empty = false, singular = false;
  PetscFunctionBegin;
  if (!of_C.known || left.empty() || left.size() != right.size()) PetscFunctionReturn(0);
  MatHandle all_G, S;
  PetscCall(MatGetSize(G, &n, nullptr));
  PetscCall(gather(G, &all_G));
  PetscCall(project(all_G, n, left, right, &S, &empty));
  if (!empty) {
    Handle<KSP, KSPDestroy> ksp;
    PetscCall(create_direct(PETSC_COMM_SELF, S, "linear_index_", ksp.out()));
    PetscCall(is_singular(ksp, &singular));
  }
  out->higher = empty || singular;
  if (out->higher) PetscCall(name_rows(S, left, &out->rows));
  PetscFunctionReturn(0);
}

}  // namespace bs
