// A d-vector in one SIMD register: d = 1, 2, 3 numbers in 1, 2, 4 lanes (the fourth is padding without meaning).
#pragma once
#include <cstring>
#ifdef __AVX__
#include <immintrin.h>
#endif

namespace bs {

/// Doubles a padded d-vector takes.
template <int d>
inline constexpr int LANES = d == 3 ? 4 : d;

namespace lanes {

template <class Real, int width>
struct Register {
  typedef Real type __attribute__((vector_size(sizeof(Real) * width)));
};

template <int d>
using Vector = typename Register<double, LANES<d>>::type;

/// `p` need not be aligned.
template <int d>
inline Vector<d> load(const double* p) noexcept {
  Vector<d> v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

/// Single precision in memory, double in the register.
template <int d>
inline Vector<d> load(const float* p) noexcept {
  typename Register<float, LANES<d>>::type v;
  std::memcpy(&v, p, sizeof v);
  return __builtin_convertvector(v, Vector<d>);
}

#ifdef __AVX__
// one instruction, where the compiler makes five
template <>
inline Vector<3> load<3>(const float* p) noexcept {
  return reinterpret_cast<Vector<3>>(_mm256_cvtps_pd(_mm_loadu_ps(p)));
}
#endif

template <int d>
inline void store(Vector<d> v, double* p) noexcept {
  std::memcpy(p, &v, sizeof v);
}

template <int d>
inline Vector<d> splat(double s) noexcept {
  return s - Vector<d>{};
}

}  // namespace lanes
}  // namespace bs
