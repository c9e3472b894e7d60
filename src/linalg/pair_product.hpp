// Kernels of a product with S, pair by pair.
#pragma once
#include "linalg/lanes.hpp"
#include "linalg/pair_matrix.hpp"

namespace bs {

/// B (a - b) = t q + w (w . q),  q = a - b.
template <int d>
inline lanes::Vector<d> apply(const float* pair, lanes::Vector<d> a, lanes::Vector<d> b) noexcept {
  const lanes::Vector<d> q = a - b;
  if constexpr (d == 3) {  // (w, t) is one register
    const lanes::Vector<3> v = lanes::load<3>(pair);
    const lanes::Vector<3> m = v * q;
    return lanes::splat<3>(v[3]) * q + lanes::splat<3>(m[0] + m[1] + m[2]) * v;
  } else {
    double s = 0;
    for (int c = 0; c < d; ++c) s += static_cast<double>(pair[c]) * q[c];
    lanes::Vector<d> f;
    for (int c = 0; c < d; ++c) f[c] = static_cast<double>(pair[d]) * q[c] + s * static_cast<double>(pair[c]);
    return f;
  }
}

/// B = t I + w w^T of a pair's numbers, row by row.
template <int d, class Real>
inline void write_block(const float* pair, Real* B) noexcept {
  for (int r = 0; r < d; ++r)
    for (int c = 0; c < d; ++c)
      B[r * d + c] = static_cast<Real>(pair[r]) * static_cast<Real>(pair[c]) + (r == c ? static_cast<Real>(pair[d]) : Real(0));
}

/// (n, d) numbers read as registers; the last point's from a padded copy, since nothing may be read behind the array.
template <int d>
class Points {
 public:
  Points(const double* values, PetscInt n) noexcept : values_(values), last_(n - 1) {
    for (int c = 0; c < d && n > 0; ++c) tail_[c] = values[static_cast<std::size_t>(n - 1) * d + c];
  }
  lanes::Vector<d> operator[](PetscInt i) const noexcept { return lanes::load<d>(i == last_ ? tail_ : values_ + static_cast<std::size_t>(i) * d); }

 private:
  const double* values_;
  PetscInt last_;
  double tail_[4] = {0, 0, 0, 0};
};

template <int d>
inline void put(lanes::Vector<d> v, double* to) noexcept {
  for (int c = 0; c < d; ++c) to[c] = v[c];
}

/// A v for a d x d block of any precision, row by row in memory, symmetric; one number behind it is read.
template <int d, class Real>
inline lanes::Vector<d> times(const Real* A, lanes::Vector<d> v) noexcept {
  lanes::Vector<d> sum = lanes::load<d>(A) * lanes::splat<d>(v[0]);
  for (int c = 1; c < d; ++c) sum += lanes::load<d>(A + c * d) * lanes::splat<d>(v[c]);
  return sum;
}

/// y_i = A_i p_i + sum_j B_ij (p_i - p_j) over the owned pairs; `sums`: (n, LANES<d>), zero, holds what rows before i add.
template <int d>
inline void multiply_pairs(const PairPattern& pattern, const double* node, const float* pair, const double* p, double* sums, double* y) noexcept {
  constexpr int W = LANES<d>, area = d * d, width = d + 1;
  const PetscInt *start = pattern.start.data(), *other = pattern.other.data();
  const Points<d> points(p, pattern.n);
  for (PetscInt i = 0; i < pattern.n; ++i) {
    const lanes::Vector<d> pi = points[i];
    lanes::Vector<d> sum = lanes::load<d>(sums + static_cast<std::size_t>(i) * W) + times<d>(node + static_cast<std::size_t>(i) * area, pi);
    const PetscInt end = start[i + 1];
    for (PetscInt k = start[i]; k < end; ++k) {
      double* at = sums + static_cast<std::size_t>(other[k]) * W;
      const lanes::Vector<d> f = apply<d>(pair + static_cast<std::size_t>(k) * width, pi, points[other[k]]);
      sum += f;
      lanes::store<d>(lanes::load<d>(at) - f, at);
    }
    put<d>(sum, y + static_cast<std::size_t>(i) * d);
  }
}

/// y_i += B_ig (p_i - p_g) over the pairs cut by the rank boundary; `ghosts`: (ghosts, d).
template <int d>
inline void multiply_cut(const PairPattern& pattern, const float* cut, const double* p, const double* ghosts, double* y) noexcept {
  constexpr int width = d + 1;
  const Points<d> points(p, pattern.n), others(ghosts, pattern.ghosts);
  for (std::size_t r = 0; r < pattern.cut_row.size(); ++r) {
    const PetscInt i = pattern.cut_row[r];
    lanes::Vector<d> sum = lanes::splat<d>(0.0);
    for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k)
      sum += apply<d>(cut + static_cast<std::size_t>(k) * width, points[i], others[pattern.ghost[k]]);
    for (int c = 0; c < d; ++c) y[static_cast<std::size_t>(i) * d + c] += sum[c];
  }
}

}  // namespace bs
