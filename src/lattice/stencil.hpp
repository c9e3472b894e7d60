// Unit cells of the regular lattices and, by distance, which particles a spring joins.
#pragma once
#include <string>
#include <vector>

namespace bs {

enum class LatticeType { none, chain, square, triangular, cloth, cubic, bcc, fcc };

/// What is fixed by the type's name.
struct TypeInfo {
  const char* name;
  int axes;              ///< directions the lattice extends in: 1, 2, 3
  int dim_min, dim_max;  ///< dimensions d it may live in
  int dim_default;
  std::vector<double> shells;  ///< squared distance of each neighbour class, spacing 1
  std::vector<int> neighbors;  ///< neighbours of an inner particle, up to and including that class
  int neighbors_default;
};

const TypeInfo& type_info(LatticeType type);
/// Names in the order of LatticeType, as -bs_lattice_type takes them.
const std::vector<std::string>& lattice_type_names();

/// One neighbour seen from a site: the particle at `site` of the cell `cell` further on.
struct Neighbour {
  int cell[3];
  int site;
  int shell;         ///< neighbour class, 0-based
  double offset[3];  ///< from particle to neighbour, spacing 1
};

/// A site of the unit cell, or one of the two kinds of rows of the triangular lattice.
struct Site {
  double shift[3];  ///< from the cell's corner, spacing 1
  std::vector<Neighbour> neighbours;
};

/// The unit cell and the neighbours of each of its sites.
struct Stencil {
  int sites = 1;               ///< particles per cell
  bool staggered = false;      ///< triangular: every second row (odd index along y) is shifted by half a spacing
  double edge[3] = {1, 1, 1};  ///< cell edges, spacing 1
  std::vector<Site> kinds;     ///< `sites` of them, or 2 where staggered (even row, odd row)
};

/// Number of shells that make up `neighbors` neighbours; 0 where the type has no such number.
int shell_count(LatticeType type, int neighbors);

/// The stencil of `type` (not none) with springs to the first `shells` classes.
Stencil make_stencil(LatticeType type, int shells);

}  // namespace bs
