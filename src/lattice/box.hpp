// A periodic box: its contents are repeated along some of its edges.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>

namespace bs {

/// d edge vectors e_k, rows of `edges`, not necessarily orthogonal; space is repeated along those whose direction is periodic. The image of
/// a point in the box numbered s = (s_1, ..., s_d) is displaced by the sum of s_k e_k.
struct PeriodicBox {
  bool periodic[3] = {false, false, false};
  std::array<double, 9> edges{};  ///< (d, d), row k: e_k [m]
  bool active() const { return periodic[0] || periodic[1] || periodic[2]; }
  bool orthogonal(int d) const {
    for (int k = 0; k < d; ++k)
      for (int c = 0; c < d; ++c)
        if (k != c && edges[static_cast<std::size_t>(k * d + c)] != 0) return false;
    return true;
  }
};

/// Volume (area, length) that d edge vectors span: |det|.
inline double box_volume(const double* e, int d) {
  if (d == 1) return std::abs(e[0]);
  if (d == 2) return std::abs(e[0] * e[3] - e[1] * e[2]);
  return std::abs(e[0] * (e[4] * e[8] - e[5] * e[7]) - e[1] * (e[3] * e[8] - e[5] * e[6]) + e[2] * (e[3] * e[7] - e[4] * e[6]));
}

/// Inverts the edges: `out` (d, d) is such that x = sum of r_k e_k has r_k = sum of x_c out[c * d + k]. False where the edges span no volume.
inline bool invert_edges(const double* e, int d, double* out) {
  const double volume = box_volume(e, d);
  double size = 1;
  for (int k = 0; k < d; ++k) {
    double square = 0;
    for (int c = 0; c < d; ++c) square += e[k * d + c] * e[k * d + c];
    size *= std::sqrt(square);
  }
  if (!(volume > 1e-12 * size) || !std::isfinite(volume)) return false;
  if (d == 1) {
    out[0] = 1 / e[0];
  } else if (d == 2) {
    const double det = e[0] * e[3] - e[1] * e[2];
    out[0] = e[3] / det, out[1] = -e[1] / det, out[2] = -e[2] / det, out[3] = e[0] / det;
  } else {
    for (int k = 0; k < 3; ++k) {
      const double *a = e + (k + 1) % 3 * 3, *b = e + (k + 2) % 3 * 3;
      const double normal[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
      const double height = normal[0] * e[k * 3] + normal[1] * e[k * 3 + 1] + normal[2] * e[k * 3 + 2];
      for (int c = 0; c < 3; ++c) out[c * 3 + k] = normal[c] / height;
    }
  }
  return true;
}

/// Completes the box: an edge that is not periodic may be left 0 and becomes a unit vector. False where the edges span no volume.
inline bool complete_edges(PeriodicBox* box, int d) {
  double inverse[9];
  for (int k = 0; k < d; ++k) {
    double size = 0;
    for (int c = 0; c < d; ++c) size += std::abs(box->edges[static_cast<std::size_t>(k * d + c)]);
    if (size == 0 && !box->periodic[k]) box->edges[static_cast<std::size_t>(k * d + k)] = 1;
  }
  return invert_edges(box->edges.data(), d, inverse);
}

/// Finds nearest images in a periodic box by a reduced basis of its periodic edges: however skew the edges are, neighbouring images differ by at most
/// 1 in each number of that basis.
class NearestImages {
 public:
  NearestImages(const PeriodicBox& box, int d);
  /// Finds the two shortest vectors of the form dx + sum of s_k e_k. `shift` (d) becomes s of the shortest; the function returns by how much its
  /// squared length is less than that of the second (infinity: there is no second). Shifts by more than 10^9 boxes are given as 10^9.
  double find(const double* dx, std::int64_t* shift) const;

 private:
  bool shorten_by_others(const PeriodicBox& box, int k);

  int d_, count_ = 0;              ///< dimensions; periodic edges
  std::array<double, 9> b_{};      ///< (count, d) the reduced basis
  std::array<double, 9> whole_{};  ///< (count, d) integers with b_k = sum of whole_kj e_j
};

}  // namespace bs
