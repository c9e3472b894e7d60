#include "lattice/generator.hpp"

#include <algorithm>
#include <cmath>

namespace bs {

const TypeInfo& type_info(LatticeType type) {
  // cubic: edge, face diagonal, body diagonal; cloth: structural, shear, bend (two apart along an axis);
  // bcc, fcc, diamond: spacing is the edge of the cubic cell; kagome, honeycomb: the distance of nearest neighbours. These come first.
  static const std::vector<TypeInfo> table = {
      {"none", 0, 1, 3, 3, {}, {}, 0},
      {"chain", 1, 1, 3, 1, {1.0}, {2}, 2},
      {"square", 2, 2, 3, 2, {1.0, 2.0}, {4, 8}, 8},
      {"triangular", 2, 2, 3, 2, {1.0}, {6}, 6},
      {"cloth", 2, 2, 3, 3, {1.0, 2.0, 4.0}, {4, 8, 12}, 12},
      {"cubic", 3, 3, 3, 3, {1.0, 2.0, 3.0}, {6, 18, 26}, 18},
      {"bcc", 3, 3, 3, 3, {0.75, 1.0}, {8, 14}, 14},
      {"fcc", 3, 3, 3, 3, {0.5, 1.0}, {12, 18}, 12},
      {"kagome", 2, 2, 3, 2, {1.0, 3.0}, {4, 8}, 4},
      {"honeycomb", 2, 2, 3, 2, {1.0, 3.0, 4.0}, {3, 9, 12}, 3},
      {"diamond", 3, 3, 3, 3, {0.1875, 0.5}, {4, 16}, 4},
  };
  return table[static_cast<std::size_t>(type)];
}

const std::vector<std::string>& lattice_type_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (int t = 0; t <= static_cast<int>(LatticeType::diamond); ++t) all.emplace_back(type_info(static_cast<LatticeType>(t)).name);
    return all;
  }();
  return names;
}

const std::vector<std::string>& prune_rule_names() {
  static const std::vector<std::string> names = {"none", "dangling", "rattlers"};
  return names;
}

int shell_count(LatticeType type, int neighbors) {
  const std::vector<int>& known = type_info(type).neighbors;
  for (std::size_t s = 0; s < known.size(); ++s)
    if (known[s] == neighbors) return static_cast<int>(s) + 1;
  return 0;
}

namespace {

/// The sites of bcc, fcc, kagome, honeycomb and diamond in their rectangular cell.
void place_sites(LatticeType type, Stencil* s) {
  const double h = std::sqrt(0.75);  // height of an equilateral triangle of side 1
  if (type == LatticeType::bcc) {
    s->kinds = {{{0, 0, 0}, {}}, {{0.5, 0.5, 0.5}, {}}};
  } else if (type == LatticeType::fcc || type == LatticeType::diamond) {
    s->kinds = {{{0, 0, 0}, {}}, {{0.5, 0.5, 0}, {}}, {{0.5, 0, 0.5}, {}}, {{0, 0.5, 0.5}, {}}};
    for (std::size_t k = 0; type == LatticeType::diamond && k < 4; ++k) {
      const double* at = s->kinds[k].shift;
      s->kinds.push_back({{at[0] + 0.25, at[1] + 0.25, at[2] + 0.25}, {}});
    }
  } else if (type == LatticeType::kagome) {
    s->edge[0] = 2;
    s->edge[1] = 4 * h;
    s->kinds = {{{0, 0, 0}, {}}, {{1, 0, 0}, {}}, {{0.5, h, 0}, {}}, {{0, 2 * h, 0}, {}}, {{1, 2 * h, 0}, {}}, {{1.5, 3 * h, 0}, {}}};
  } else if (type == LatticeType::honeycomb) {
    s->edge[0] = 2 * h;
    s->edge[1] = 3;
    s->kinds = {{{h, 0, 0}, {}}, {{0, 0.5, 0}, {}}, {{0, 1.5, 0}, {}}, {{h, 2, 0}, {}}};
  }
  s->sites = static_cast<int>(s->kinds.size());
}

Stencil unit_cell(LatticeType type) {
  Stencil s;
  s.kinds.push_back({{0, 0, 0}, {}});
  if (type == LatticeType::triangular) {
    s.staggered = true;
    s.edge[1] = std::sqrt(0.75);  // height of an equilateral triangle of side 1
    s.kinds.push_back({{0.5, 0, 0}, {}});
  } else {
    place_sites(type, &s);
  }
  return s;
}

/// Class of a neighbour at squared distance r2, -1 for none of the first `shells`.
int shell_of(const TypeInfo& info, int shells, double r2) {
  for (int s = 0; s < shells; ++s)
    if (std::abs(r2 - info.shells[static_cast<std::size_t>(s)]) < 1e-9) return s;
  return -1;
}

/// Appends the neighbours of kind `from` that lie `cell` cells away.
void add_neighbours_in(const TypeInfo& info, int shells, const int (&cell)[3], std::size_t from, Stencil* s) {
  for (int site = 0; site < s->sites; ++site) {
    const std::size_t kind = s->staggered ? (from + static_cast<std::size_t>(cell[1] & 1)) % 2 : static_cast<std::size_t>(site);
    Neighbour n{{cell[0], cell[1], cell[2]}, site, 0, {}};
    double r2 = 0;
    for (int k = 0; k < 3; ++k) {
      n.offset[k] = cell[k] * s->edge[k] + s->kinds[kind].shift[k] - s->kinds[from].shift[k];
      r2 += n.offset[k] * n.offset[k];
    }
    n.shell = shell_of(info, shells, r2);
    if (n.shell >= 0) s->kinds[from].neighbours.push_back(n);
  }
}

}  // namespace

Stencil make_stencil(LatticeType type, int shells) {
  const TypeInfo& info = type_info(type);
  Stencil s = unit_cell(type);
  // No class is more than two cells away.
  const int ry = info.axes > 1 ? 2 : 0, rz = info.axes > 2 ? 2 : 0;
  for (std::size_t from = 0; from < s.kinds.size(); ++from)
    for (int z = -rz; z <= rz; ++z)
      for (int y = -ry; y <= ry; ++y)
        for (int x = -2; x <= 2; ++x) add_neighbours_in(info, shells, {x, y, z}, from, &s);
  return s;
}

const Neighbour* straight_on(const Site& kind, const Neighbour& way) {
  for (const Neighbour& n : kind.neighbours) {
    double off = 0;
    for (int k = 0; k < 3; ++k) off = std::max(off, std::abs(n.offset[k] - way.offset[k]));
    if (n.shell == 0 && off < 1e-9) return &n;
  }
  return nullptr;
}

bool has_lines(LatticeType type) {
  const Stencil stencil = make_stencil(type, 1);
  for (const Site& kind : stencil.kinds)
    for (const Neighbour& n : kind.neighbours) {
      Neighbour back = n;
      for (double& c : back.offset) c = -c;
      if (straight_on(kind, back)) return true;
    }
  return false;
}

}  // namespace bs
