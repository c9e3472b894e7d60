// The number by which half springs name their other end: its row in the input and, in a periodic box, which of its images it is.
#pragma once
#include <algorithm>
#include <cstdint>

namespace bs {

/// row * 2^21 + three shifts of 7 bits; ascending by row, then the particle itself, then its images. Without a periodic box all are
/// rows * 2^21.
namespace image {

constexpr int BITS = 7, SHIFT_BITS = 3 * BITS, MOST = 63;

/// 0, 1, -1, 2, -2, ... become 0, 1, 2, 3, 4, ...
inline std::int64_t fold(std::int64_t s) { return s > 0 ? 2 * s - 1 : -2 * s; }
inline int unfold(std::int64_t f) { return static_cast<int>(f % 2 ? (f + 1) / 2 : -f / 2); }

inline std::int64_t key(std::int64_t row) { return row << SHIFT_BITS; }
/// |shift| <= MOST
inline std::int64_t key(std::int64_t row, const std::int64_t* shift, int d, int sign) {
  std::int64_t code = 0;
  for (int k = 0; k < std::min(d, 3); ++k) code |= fold(sign * shift[k]) << (BITS * k);
  return row << SHIFT_BITS | code;
}
inline std::int64_t row(std::int64_t key) { return key >> SHIFT_BITS; }
/// Whether it is an image and not the particle itself.
inline bool shifted(std::int64_t key) { return (key & ((std::int64_t{1} << SHIFT_BITS) - 1)) != 0; }
inline int shift(std::int64_t key, int k) { return unfold(key >> (BITS * k) & ((1 << BITS) - 1)); }

}  // namespace image
}  // namespace bs
