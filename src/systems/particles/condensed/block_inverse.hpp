// Inverses of small symmetric positive definite blocks.
#pragma once
#include <algorithm>
#include <cmath>

namespace bs {

/// Inverse of a symmetric positive definite d x d block by its Cholesky factor; false where a pivot is not above `least`.
template <int d>
inline bool invert(const double* A, double least, double* inverse) noexcept {
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

}  // namespace bs
