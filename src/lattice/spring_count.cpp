// How many springs a lattice will have, known before any is laid.
#include <algorithm>

#include "lattice/generator.hpp"

namespace bs {

namespace {

std::int64_t cells(const GeneratorSpec& spec, int k) {
  if (k >= type_info(spec.type).axes) return 1;
  return spec.size[std::min(static_cast<std::size_t>(k), spec.size.size() - 1)];
}

/// Of the cells 0 to n - 1, those whose neighbour `step` further on is one of them, or an image of one; with `parity` 0 or 1 only even or odd ones.
std::int64_t inside(const GeneratorSpec& spec, int k, std::int64_t step, int parity = -1) {
  const std::int64_t n = cells(spec, k);
  const bool periodic = spec.repeats(k);
  const std::int64_t first = periodic ? 0 : std::max<std::int64_t>(0, -step), end = periodic ? n : std::min(n, n - step);
  if (end <= first) return 0;
  if (parity < 0) return end - first;
  return (end + 1 - parity) / 2 - (first + 1 - parity) / 2;
}

}  // namespace

std::int64_t spring_count(const GeneratorSpec& spec) {
  const int neighbors = spec.neighbors > 0 ? spec.neighbors : type_info(spec.type).neighbors_default;
  const Stencil stencil = make_stencil(spec.type, shell_count(spec.type, neighbors));
  std::int64_t ends = 0;
  for (std::size_t kind = 0; kind < stencil.kinds.size(); ++kind)
    for (const Neighbour& m : stencil.kinds[kind].neighbours)
      ends += inside(spec, 0, m.cell[0]) * inside(spec, 1, m.cell[1], stencil.staggered ? static_cast<int>(kind) : -1) * inside(spec, 2, m.cell[2]);
  return ends / 2;
}

}  // namespace bs
