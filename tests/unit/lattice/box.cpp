// Periodic boxes: keys of images, nearest images, inverse edges.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "lattice/box.hpp"
#include "network/migrate.hpp"

using namespace bs;

TEST_CASE("keys name a row and its image, rows first", "[box]") {
  const std::int64_t rows[] = {0, 1, 5, (std::int64_t{1} << 40) + 3};
  for (const std::int64_t row : rows)
    for (std::int64_t a = -63; a <= 63; a += 9)
      for (std::int64_t b = -63; b <= 63; b += 21) {
        const std::int64_t shift[3] = {a, b, -a};
        for (const int sign : {1, -1}) {
          const std::int64_t key = image::key(row, shift, 3, sign);
          CHECK(key >= 0);
          CHECK(image::row(key) == row);
          for (int k = 0; k < 3; ++k) CHECK(image::shift(key, k) == sign * shift[k]);
          CHECK(image::shifted(key) == (a != 0 || b != 0));
          CHECK(key >= image::key(row));
          CHECK(key < image::key(row + 1));
        }
      }
}

TEST_CASE("the inverse of the edges gives reduced coordinates", "[box]") {
  const double e[9] = {2, 0.3, -0.2, 0.1, 1.5, 0.4, -0.6, 0.2, 3};
  double inverse[9];
  REQUIRE(invert_edges(e, 3, inverse));
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j) {
      double r = 0;
      for (int c = 0; c < 3; ++c) r += e[k * 3 + c] * inverse[c * 3 + j];
      CHECK(r == Approx(k == j ? 1.0 : 0.0).margin(1e-15));
    }
  const double flat[4] = {1, 2, 2, 4};
  CHECK_FALSE(invert_edges(flat, 2, inverse));
}

namespace {

/// Of all images of dx that are no further away than dx itself the least square; edges (d, d) below the diagonal and on it.
double least_square(const PeriodicBox& box, int d, const double* dx) {
  double reach = 0, least = INFINITY;
  for (int c = 0; c < d; ++c) reach += dx[c] * dx[c];
  const std::function<void(int, std::array<double, 3>)> look = [&](int k, std::array<double, 3> x) {
    if (k < 0) {
      least = std::min(least, x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
      return;
    }
    const double* e = box.edges.data() + k * d;
    const auto at = static_cast<std::size_t>(k);
    const double most = std::sqrt(reach) / e[k] + 1e-9;
    for (double s = box.periodic[k] ? std::ceil(-x[at] / e[k] - most) : 0; s <= (box.periodic[k] ? -x[at] / e[k] + most : 0); ++s) {
      std::array<double, 3> y = x;
      for (std::size_t c = 0; c <= at; ++c) y[c] += s * e[c];
      look(k - 1, y);
    }
  };
  std::array<double, 3> x{};
  std::copy_n(dx, d, x.begin());
  look(d - 1, x);
  return least;
}

/// n vectors of d numbers, mirrored at the plane across m.
void mirror(const double* m, int d, int n, double* v) {
  const double size = std::inner_product(m, m + d, m, 0.0);
  for (int k = 0; k < n; ++k) {
    const double along = std::inner_product(m, m + d, v + k * d, 0.0);
    for (int c = 0; c < d; ++c) v[k * d + c] -= 2 * along / size * m[c];
  }
}

}  // namespace

TEST_CASE("the nearest image is the nearest of all, however skew the box is, along whichever edges it repeats", "[box]") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int d = 1; d <= 3; ++d)
    for (int along = 1; along < 1 << d; ++along)
      for (int n = 0; n < 300; ++n) {
        const double tilt = n % 3 == 0 ? 0.5 : 10;
        PeriodicBox box;
        for (int k = 0; k < d; ++k) {
          box.periodic[k] = (along >> k & 1) != 0;
          for (int c = 0; c < k; ++c) box.edges[static_cast<std::size_t>(k * d + c)] = tilt * uniform(random);
          box.edges[static_cast<std::size_t>(k * d + k)] = 1 + 0.5 * uniform(random);
        }
        double dx[3] = {4 * uniform(random), 4 * uniform(random), 4 * uniform(random)};
        const double m[3] = {uniform(random), uniform(random), uniform(random)}, least = least_square(box, d, dx);
        mirror(m, d, d, box.edges.data());
        mirror(m, d, 1, dx);
        std::int64_t shift[3] = {0, 0, 0};
        const double further = NearestImages(box, d).find(dx, shift);
        double found = 0;
        for (int c = 0; c < d; ++c) {
          double x = dx[c];
          for (int k = 0; k < d; ++k) x += static_cast<double>(shift[k]) * box.edges[static_cast<std::size_t>(k * d + c)];
          found += x * x;
        }
        INFO("d = " << d << ", along " << along << ", box " << n);
        CHECK(found == Approx(least).epsilon(1e-11).margin(1e-12));
        CHECK(further >= 0);
        for (int k = 0; k < d; ++k) CHECK((box.periodic[k] || shift[k] == 0));
      }
}

TEST_CASE("two images that are equally near are told in a skew box, too", "[box]") {
  PeriodicBox box;
  box.edges = {1, 0, 0, 7, 1, 0, -3, 5, 1};
  std::fill_n(box.periodic, 3, true);
  std::int64_t shift[3];
  const double half[3] = {0.5, 0.1, 0}, beside[3] = {0.4, 0.1, 0}, corner[3] = {2.5, 3.5, 0.5};
  const NearestImages nearest(box, 3);
  CHECK(nearest.find(half, shift) == Approx(0).margin(1e-14));
  CHECK(nearest.find(beside, shift) == Approx(0.2));
  CHECK(nearest.find(corner, shift) == Approx(0).margin(1e-14));
}

TEST_CASE("places that are many boxes apart are brought together at once, not box by box", "[box]") {
  PeriodicBox box;
  box.edges = {1, 0, 0, 7, 1, 0, -3, 5, 1};  // of determinant 1 and whole numbers: the images of a place are those of a unit cube
  std::fill_n(box.periodic, 3, true);
  const std::int64_t far[3] = {900000000, -800000000, 700000000};
  double dx[3] = {0.25, 0.125, -0.25};
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) dx[c] += static_cast<double>(far[k]) * box.edges[static_cast<std::size_t>(3 * k + c)];
  std::int64_t shift[3];
  CHECK(NearestImages(box, 3).find(dx, shift) == Approx(0.5).epsilon(1e-6));
  for (int k = 0; k < 3; ++k) CHECK(shift[k] == -far[k]);
}
