// Memory bandwidth of one core by STREAM's triad a = b + s c: 24 bytes an element, the best of several passes.
#include <algorithm>
#include <cstdio>
#include "cube.hpp"

int main(int argc, char** argv) {
  const peers::Arguments given(argc, argv, {{"elements", 2e7}, {"passes", 10}});
  const std::size_t n = static_cast<std::size_t>(given["elements"]);
  peers::Values a(n, 1.0), b(n, 2.0), c(n, 0.5);
  double best = 1e300;
  for (int pass = 0; pass < given.whole("passes"); ++pass) {
    const double start = peers::now();
    const double s = 3.0 + pass;
    for (std::size_t k = 0; k < n; ++k) a[k] = b[k] + s * c[k];
    best = std::min(best, peers::now() - start);
    if (a[n / 2] != 2.0 + 0.5 * s) return 1;
  }
  std::printf("{\"bytes_per_s\": %.17g}\n", 24.0 * static_cast<double>(n) / best);
}
