// Periodic boxes: keys of images, nearest images, inverse edges.
#include <catch2/catch.hpp>
#include <cmath>
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

TEST_CASE("the nearest image is the nearest of many, in a skew box too", "[box]") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-4, 4);
  PeriodicBox box;
  box.edges = {1, 0, 0.45, 1};
  double inverse[9];
  REQUIRE(invert_edges(box.edges.data(), 2, inverse));
  for (const bool open : {false, true}) {
    box.periodic[0] = true;
    box.periodic[1] = !open;
    for (int n = 0; n < 200; ++n) {
      const double dx[2] = {uniform(random), uniform(random)};
      int shift[3] = {0, 0, 0};
      nearest_image(box, inverse, 2, dx, shift);
      double best = INFINITY, found = 0;
      for (int a = -12; a <= 12; ++a)
        for (int b = open ? 0 : -12; b <= (open ? 0 : 12); ++b) {
          const double x = dx[0] + a + 0.45 * b, y = dx[1] + b, square = x * x + y * y;
          best = std::min(best, square);
          if (a == shift[0] && b == shift[1]) found = square;
        }
      CHECK(found == Approx(best).epsilon(1e-12));
    }
  }
}
