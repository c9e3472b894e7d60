#include "lattice/box.hpp"
#include <algorithm>

namespace bs {

namespace {

/// x = dx + sum of s_k b_k of n vectors b (n, d), and its square.
struct Sum {
  int n, d;
  const double *b, *dx;
  double square(const double* s, double* x) const {
    double square = 0;
    for (int c = 0; c < d; ++c) {
      x[c] = dx[c];
      for (int k = 0; k < n; ++k) x[c] += s[k] * b[k * d + c];
      square += x[c] * x[c];
    }
    return square;
  }
};

/// Shortens the sum by one vector after the other.
void round_off(const Sum& sum, double* s) {
  double x[3], least = sum.square(s, x);
  for (bool moved = true; moved;) {
    moved = false;
    for (int k = 0; k < sum.n; ++k) {
      const double *b = sum.b + k * sum.d, before = s[k];
      double along = 0, size = 0;
      for (int c = 0; c < sum.d; ++c) along += x[c] * b[c], size += b[c] * b[c];
      s[k] -= std::round(along / size);
      const double square = sum.square(s, x);
      if (square < least) {  // not for a tie, which would have no end
        least = square;
        moved = true;
      } else {
        s[k] = before;
        (void)sum.square(s, x);
      }
    }
  }
}

/// Shortens the sum until none of its neighbours, s_k by -1, 0 or 1 others, is shorter; returned is how much shorter its square is than the next
/// one's.
double shorten(const Sum& sum, double* s) {
  const int a = sum.n > 0, b = sum.n > 1, c = sum.n > 2;
  for (;;) {
    round_off(sum, s);
    const double middle[3] = {s[0], s[1], s[2]};
    double best = INFINITY, second = INFINITY, x[3];
    for (int i = -a; i <= a; ++i)
      for (int j = -b; j <= b; ++j)
        for (int k = -c; k <= c; ++k) {
          const double beside[3] = {middle[0] + i, middle[1] + j, middle[2] + k}, square = sum.square(beside, x);
          if (square < best) {
            second = best;
            best = square;
            std::copy_n(beside, 3, s);
          } else if (square < second) {
            second = square;
          }
        }
    if (std::equal(s, s + 3, middle)) return second - best;
  }
}

}  // namespace

// Where no b_k is shortened by -1, 0 or 1 of each of the others, up to three vectors are reduced in Minkowski's sense; then the faces of the cell of
// points nearest to one image belong to vectors with such numbers (P. Q. Nguyen, D. Stehle, ACM Trans. Algorithms 5, 46, 2009), and an image that is
// no further away than these neighbours is the nearest.
NearestImages::NearestImages(const PeriodicBox& box, int d) : d_(d) {
  for (int k = 0; k < d; ++k) {
    if (!box.periodic[k]) continue;
    std::copy_n(box.edges.data() + k * d, d, b_.data() + count_ * d);
    whole_[static_cast<std::size_t>(count_++ * d + k)] = 1;
  }
  for (bool shorter = true; shorter;) {
    shorter = false;
    for (int k = 0; k < count_; ++k) shorter = shorten_by_others(box, k) || shorter;
  }
}

bool NearestImages::shorten_by_others(const PeriodicBox& box, int k) {
  double others[6] = {}, s[3] = {0, 0, 0}, whole[3], e[3] = {0, 0, 0}, b[3], x[3];
  double* const own = b_.data() + k * d_;
  std::copy_n(whole_.data() + k * d_, d_, whole);
  for (int j = 0, at = 0; j < count_; ++j)
    if (j != k) std::copy_n(b_.data() + j * d_, d_, others + at++ * d_);
  (void)shorten({count_ - 1, d_, others, own}, s);
  for (int j = 0, at = 0; j < count_; ++j) {
    if (j == k) continue;
    for (int c = 0; c < d_; ++c) whole[c] += s[at] * whole_[static_cast<std::size_t>(j * d_ + c)];
    ++at;
  }
  const Sum afresh = {d_, d_, box.edges.data(), e};  // so that rounding errors do not add up
  if (!(afresh.square(whole, b) < afresh.square(whole_.data() + k * d_, x))) return false;
  std::copy_n(whole, d_, whole_.data() + k * d_);
  std::copy_n(b, d_, own);
  return true;
}

double NearestImages::find(const double* dx, std::int64_t* shift) const {
  constexpr double MOST = 1e9;
  double s[3] = {0, 0, 0};
  const double further = shorten({count_, d_, b_.data(), dx}, s);
  for (int c = 0; c < d_; ++c) {
    double boxes = 0;
    for (int k = 0; k < count_; ++k) boxes += s[k] * whole_[static_cast<std::size_t>(k * d_ + c)];
    shift[c] = static_cast<std::int64_t>(std::clamp(boxes, -MOST, MOST));
  }
  return further;
}

}  // namespace bs
