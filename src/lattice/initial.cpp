#include "lattice/initial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bs {

namespace {
const char* const face_names[6] = {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"};
}

std::string parse_faces(const std::vector<std::string>& names, int axes, Faces* faces) {
  *faces = 0;
  for (const std::string& name : names) {
    int face = 0;
    while (face < 2 * axes && name != face_names[face]) ++face;
    if (face == 2 * axes) {
      std::string known = face_names[0];
      for (int f = 1; f < 2 * axes; ++f) known += std::string(", ") + face_names[f];
      return "-bs_lattice_fixed " + name + ": no such face; the faces of this lattice are " + known;
    }
    *faces |= 1u << face;
  }
  return {};
}

void apply_faces(Faces faces, const Box& box, double depth, int dim, const std::vector<double>& position, std::vector<std::uint8_t>* fixed) {
  for (int k = 0; k < dim; ++k) {
    const bool lower = faces >> (2 * k) & 1u, upper = faces >> (2 * k + 1) & 1u;
    if (!lower && !upper) continue;
    const double size = std::max(std::abs(box.lo[k]), std::abs(box.hi[k]));
    const double reach = depth + 1e-9 * (box.hi[k] - box.lo[k]) + 8 * std::numeric_limits<double>::epsilon() * size;
    for (std::size_t p = 0; p < fixed->size(); ++p) {
      const double x = position[p * static_cast<std::size_t>(dim) + static_cast<std::size_t>(k)];
      if ((lower && x - box.lo[k] <= reach) || (upper && box.hi[k] - x <= reach)) (*fixed)[p] = 1;
    }
  }
}

void apply_fixed_particles(const std::vector<std::int64_t>& ids, const Rows& rows, std::vector<std::uint8_t>* fixed) {
  for (const std::int64_t id : ids)
    if (id >= rows.first && id - rows.first < rows.count) (*fixed)[static_cast<std::size_t>(id - rows.first)] = 1;
}

void apply_velocity(const std::vector<double>& u, const std::vector<double>& gradient, int dim, const std::vector<double>& position,
                    const std::vector<std::uint8_t>& fixed, std::vector<double>* velocity) {
  const std::size_t d = static_cast<std::size_t>(dim), n = position.size() / d;
  velocity->assign(n * d, 0.0);
  for (std::size_t p = 0; p < n; ++p) {
    if (!fixed.empty() && fixed[p]) continue;
    for (std::size_t i = 0; i < d; ++i) {
      double v = i < u.size() ? u[i] : 0.0;
      if (!gradient.empty())
        for (std::size_t j = 0; j < d; ++j) v += gradient[i * d + j] * position[p * d + j];
      (*velocity)[p * d + i] = v;
    }
  }
}

}  // namespace bs
