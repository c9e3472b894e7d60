// Arithmetic of d numbers that the laws share.
#pragma once
#include <cmath>

namespace bs {

inline constexpr double TWO_PI = 6.28318530717958647692;

template <int d>
inline double dot(const double* a, const double* b) noexcept {
  double sum = 0;
  for (int i = 0; i < d; ++i) sum += a[i] * b[i];
  return sum;
}

template <int d>
inline double norm(const double* a) noexcept {
  return std::sqrt(dot<d>(a, a));
}

/// A += iso I + (dir n) n^T for a d x d row-major A; n need not be a unit vector.
template <int d>
inline void add_tensor(double iso, double dir, const double* n, double* A) noexcept {
  for (int i = 0; i < d; ++i) {
    for (int j = 0; j < d; ++j) A[d * i + j] += dir * n[i] * n[j];
    A[d * i + i] += iso;
  }
}

}  // namespace bs
