#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>
#include "base/arrays.hpp"
#include "base/dimension.hpp"
#include "linalg/block_icc.hpp"
#include "linalg/factor_pattern.hpp"
#include "linalg/lanes.hpp"
#include "linalg/pair_product.hpp"

namespace bs {
namespace {

/// Inverse of a symmetric positive definite d x d block by its Cholesky factor; false where a pivot is not above `least`.
template <int d>
bool invert(const double* A, double least, double* inverse) noexcept {
  double L[d * d] = {}, M[d * d] = {};
  for (int j = 0; j < d; ++j) {
    double pivot = A[j * d + j];
    for (int k = 0; k < j; ++k) pivot -= L[j * d + k] * L[j * d + k];
    if (!(pivot > least)) return false;
    L[j * d + j] = std::sqrt(pivot);
    for (int i = j + 1; i < d; ++i) {
      double sum = A[i * d + j];
      for (int k = 0; k < j; ++k) sum -= L[i * d + k] * L[j * d + k];
      L[i * d + j] = sum / L[j * d + j];
    }
  }
  for (int j = 0; j < d; ++j) {  // M = L^-1
    M[j * d + j] = 1 / L[j * d + j];
    for (int i = j + 1; i < d; ++i) {
      double sum = 0;
      for (int k = j; k < i; ++k) sum -= L[i * d + k] * M[k * d + j];
      M[i * d + j] = sum / L[i * d + i];
    }
  }
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) {
      double sum = 0;
      for (int k = std::max(i, j); k < d; ++k) sum += M[k * d + i] * M[k * d + j];
      inverse[i * d + j] = sum;
    }
  return true;
}

template <int d, class Real>
class BlockFactorOf final : public BlockFactor {
 public:
  PetscErrorCode lay_out(PairMatrix& S, double most, bool everywhere) override {
    PetscFunctionBegin;
    double least = 0;
    PetscCall(least_stiff_size(S, &least));
    if (everywhere && least == 0) PetscCall(overlap_.create_everywhere(S));
    else PetscCall(overlap_.create(S, least));
    PetscCall(make_factor_pattern(S, least, most, &overlap_, &own_));
    const bool own = own_.made();
    n_ = S.pattern().n;
    rows_ = n_ + static_cast<PetscInt>(overlap_.ghosts().size());
    start_ = own ? own_.start.data() : S.pattern().start.data();
    other_ = own ? own_.other.data() : S.pattern().other.data();
    PetscFunctionReturn(0);
  }

  Overlap& overlap() override { return overlap_; }

  bool factor(const PairMatrix& S, const std::vector<double>& diagonal, double shift) override {
    const std::size_t n = static_cast<std::size_t>(rows_), pairs = static_cast<std::size_t>(start_[rows_]);
    inverse_.resize(n * area + 4);
    upper_.resize(pairs * area + 4);
    work_.resize(n * W);
    pivot_.resize(n * area);
    for (std::size_t k = 0; k < n; ++k) std::copy_n(diagonal.data() + row_of(k) * area, area, pivot_.data() + k * area);
    double block[area];
    fill_rows(S);
    size_.assign(n, 0.0F);
    for (std::size_t i = 0; i < n; ++i)
      for (int c = 0; c < d; ++c) size_[i] = std::max(size_[i], static_cast<float>(std::abs(pivot_[i * area + c * (d + 1)])));
    std::vector<PetscInt> slot(n, -1);
    for (PetscInt k = 0; k < rows_; ++k) {
      double* P = pivot_.data() + static_cast<std::size_t>(k) * area;
      // what elimination left must be more than the rounding of what it took away
      const double least = 4 * static_cast<double>(std::numeric_limits<Real>::epsilon()) * size_[k];
      for (int c = 0; c < d; ++c) P[c * (d + 1)] += shift * size_[k];
      if (!invert<d>(P, least, block)) return false;
      for (int c = 0; c < area; ++c) inverse_[static_cast<std::size_t>(k) * area + c] = static_cast<Real>(block[c]);
      eliminate(k, block, slot);
    }
    release(pivot_);
    release(size_);
    return true;
  }

  double flops() const override { return flops_; }
  double blocks() const override { return static_cast<double>(start_[rows_]) + static_cast<double>(rows_); }

  // forward (D + U^T) t = r, backward x = t - D^-1 U x
  void solve(const double* r, double* z) override {
    std::fill(work_.begin(), work_.end(), 0.0);
    if (own_.order.empty()) {
      forward(r);
      backward(z);
      return;
    }
    const std::size_t n = own_.order.size();
    turns_.resize(n * d);
    for (std::size_t k = 0; k < n; ++k) std::copy_n(r + row_of(k) * d, d, turns_.data() + k * d);
    forward(turns_.data());
    backward(turns_.data());
    for (std::size_t k = 0; k < n; ++k) std::copy_n(turns_.data() + k * d, d, z + row_of(k) * d);
  }

 private:
  static constexpr int area = d * d, W = LANES<d>;
  typedef typename lanes::Register<Real, W>::type Lane;

  static Lane load(const Real* p) noexcept {
    Lane v;
    std::memcpy(&v, p, sizeof v);
    return v;
  }
  static Lane splat(Real s) noexcept {
    Lane v;
    for (int c = 0; c < W; ++c) v[c] = s;
    return v;
  }
  /// The upper triangle of S, and 0 for fill.
  void fill_rows(const PairMatrix& S) {
    const bool rolls = S.graph().holds;
    std::size_t count = 0;
    double block[area];
    const bool made = own_.made();
    if (made) std::fill(upper_.begin(), upper_.end(), Real(0));
    for_each_pair(S, overlap_, [&](PetscInt i, PetscInt j, const float* numbers) {
      write_block<d>(numbers, block);
      for (double& b : block) b = -b;
      if (rolls) S.hold_block(point(i), point(j), block);
      if (made) add(block, own_.turn_of(i) > own_.turn_of(j), own_.place[count]);
      else std::copy_n(block, area, upper_.data() + count * area);
      ++count;
    });
    flops_ = 2.0 * area * static_cast<double>(S.pattern().pairs());  // t I + w w^T of each pair
    if (S.remainder().created()) add_remainder(S);
  }
  std::size_t row_of(std::size_t turn) const { return own_.order.empty() ? turn : static_cast<std::size_t>(own_.order[turn]); }
  /// The local point of a row.
  PetscInt point(PetscInt row) const { return row < n_ ? row : n_ + overlap_.ghosts()[row - n_]; }
  void add(const double* block, bool transposed, PetscInt place) noexcept {
    Real* to = upper_.data() + static_cast<std::size_t>(place) * area;
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c) to[r * d + c] += static_cast<Real>(block[transposed ? c * d + r : r * d + c]);
  }
  /// What R holds between two rows.
  void add_remainder(const PairMatrix& S) {
    double block[area];
    for (PetscInt i = 0; i < n_; ++i)
      S.remainder().for_row(i, [&](PetscInt j, const double* R) {
        const PetscInt row = j < n_ ? j : overlap_.row(j - n_);
        if (row <= i) return;
        const PetscInt a = own_.turn_of(i), b = own_.turn_of(row);
        std::copy_n(R, area, block);
        S.hold_block(i, j, block);
        add(block, a > b, own_.find(std::min(a, b), std::max(a, b)));
      });
    for (const Overlap::Block& tie : overlap_.blocks()) {
      const PetscInt a = own_.turn_of(tie.a), b = own_.turn_of(tie.b);
      std::copy_n(tie.numbers, area, block);
      S.hold_block(point(tie.a), point(tie.b), block);
      add(block, a > b, own_.find(std::min(a, b), std::max(a, b)));
    }
  }
  // t_i = D_i^-1 (r_i - sum of what rows before i took from it), then t_j -= U_ij^T t_i by rows of U
  void forward(const double* r) noexcept {
    const PetscInt n = rows_, *start = start_, *other = other_;
    const Points<d> right(r, n);
    const Real *upper = upper_.data(), *inverse = inverse_.data();
    double* t = work_.data();
    for (PetscInt i = 0; i < n; ++i) {
      double* ti = t + static_cast<std::size_t>(i) * W;
      const lanes::Vector<d> w = times<d>(inverse + static_cast<std::size_t>(i) * area, right[i] + lanes::load<d>(ti));
      lanes::store<d>(w, ti);
      lanes::Vector<d> part[d];
      for (int c = 0; c < d; ++c) part[c] = lanes::splat<d>(w[c]);
      const PetscInt end = start[i + 1];
      for (PetscInt k = start[i]; k < end; ++k) {
        const Real* U = upper + static_cast<std::size_t>(k) * area;
        __builtin_prefetch(U + AHEAD);
        double* tj = t + static_cast<std::size_t>(other[k]) * W;
        lanes::Vector<d> sum = lanes::load<d>(tj);
        for (int c = 0; c < d; ++c) sum -= lanes::load<d>(U + c * d) * part[c];
        lanes::store<d>(sum, tj);
      }
    }
  }

  // x_i = t_i - D_i^-1 sum_j U_ij x_j; products with the rows of U are summed lane by lane, added up once a row
  void backward(double* z) noexcept {
    const PetscInt n = rows_, *start = start_, *other = other_;
    const Real *upper = upper_.data(), *inverse = inverse_.data();
    double* t = work_.data();
    for (PetscInt i = n - 1; i >= 0; --i) {
      lanes::Vector<d> row[d] = {};
      const PetscInt end = start[i + 1];
      for (PetscInt k = start[i]; k < end; ++k) {
        const Real* U = upper + static_cast<std::size_t>(k) * area;
        __builtin_prefetch(U - AHEAD);  // rows are read from the last to the first
        const lanes::Vector<d> x = lanes::load<d>(t + static_cast<std::size_t>(other[k]) * W);
        for (int c = 0; c < d; ++c) row[c] += lanes::load<d>(U + c * d) * x;
      }
      lanes::Vector<d> q = lanes::splat<d>(0.0);
      for (int c = 0; c < d; ++c)
        for (int lane = 0; lane < d; ++lane) q[c] += row[c][lane];
      double* ti = t + static_cast<std::size_t>(i) * W;
      const lanes::Vector<d> x = lanes::load<d>(ti) - times<d>(inverse + static_cast<std::size_t>(i) * area, q);
      lanes::store<d>(x, ti);
      put<d>(x, z + static_cast<std::size_t>(i) * d);
    }
  }

  // S_ij -= U_ki^T D_k^-1 U_kj for every pair (i, j) of k's upper neighbours that is itself linked, and i = j; the pivots in double
  void eliminate(PetscInt k, const double* inverse, std::vector<PetscInt>& slot) {
    const PetscInt begin = start_[k], end = start_[k + 1];
    PetscInt products = 2 * (end - begin);  // of d x d blocks: T and the pivot of each neighbour, then the linked pairs among them
    for (PetscInt a = begin; a < end; ++a) slot[other_[a]] = a;
    for (PetscInt a = begin; a < end; ++a) {
      const PetscInt i = other_[a];
      const Real* Ui = upper_.data() + static_cast<std::size_t>(a) * area;
      double* P = pivot_.data() + static_cast<std::size_t>(i) * area;
      Real T[area];
      for (int r = 0; r < d; ++r) {
        double row[d] = {};
        for (int m = 0; m < d; ++m)
          for (int c = 0; c < d; ++c) row[c] += static_cast<double>(Ui[m * d + r]) * inverse[m * d + c];
        for (int c = 0; c < d; ++c) T[r * d + c] = static_cast<Real>(row[c]);
        for (int m = 0; m < d; ++m)
          for (int c = 0; c < d; ++c) P[r * d + c] -= row[m] * static_cast<double>(Ui[m * d + c]);
      }
      for (PetscInt c = start_[i]; c < start_[i + 1]; ++c) {
        const PetscInt b = slot[other_[c]];
        if (b < 0) continue;
        ++products;
        subtract(T, upper_.data() + static_cast<std::size_t>(b) * area, upper_.data() + static_cast<std::size_t>(c) * area);
      }
    }
    for (PetscInt a = begin; a < end; ++a) slot[other_[a]] = -1;
    flops_ += d * area * (1.0 + 2.0 * static_cast<double>(products));  // a pivot's inverse takes d^3, a product of blocks 2 d^3
  }

  /// to -= T U, row by row in registers; one number behind each block is read.
  static void subtract(const Real* T, const Real* U, Real* to) noexcept {
    Lane row[d];
    for (int m = 0; m < d; ++m) row[m] = load(U + m * d);
    for (int r = 0; r < d; ++r) {
      Lane sum = load(to + r * d);
      for (int m = 0; m < d; ++m) sum -= splat(T[r * d + m]) * row[m];
      std::memcpy(to + r * d, &sum, d * sizeof(Real));
    }
  }

  PetscInt n_ = 0, rows_ = 0;                           ///< owned points; and with those of the overlap
  const PetscInt *start_ = nullptr, *other_ = nullptr;  ///< of the matrix's pattern, or of own_
  FactorPattern own_;
  Overlap overlap_;
  double flops_ = 0;
  static constexpr int AHEAD = 1024 / sizeof(Real);  ///< numbers prefetched ahead
  HugeVector<Real> upper_, inverse_;
  std::vector<double> pivot_;
  HugeVector<double> work_, turns_;  ///< room; right-hand side and solution by turns
  std::vector<float> size_;          ///< of the diagonal blocks before elimination
};

template <class Real>
std::unique_ptr<BlockFactor> create(int dim) {
  return with_dimension(dim, [](auto d) -> std::unique_ptr<BlockFactor> { return std::make_unique<BlockFactorOf<d, Real>>(); });
}

}  // namespace

std::unique_ptr<BlockFactor> create_block_factor(int dim, bool single_precision) {
  return single_precision ? create<float>(dim) : create<double>(dim);
}

}  // namespace bs
