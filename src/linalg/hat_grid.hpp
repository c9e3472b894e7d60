// d-linear hat functions on a grid over points in space: the shares of a point in the nodes around it.
#pragma once
#include <petscsys.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>
#include "linalg/graph.hpp"
#include "linalg/lanes.hpp"

namespace bs {

class HatGrid {
 public:
  /// Collective. The finest grid of about cubic cells that fill the box of the owned points, with at most `nodes` nodes; none if the points
  /// are all in one place. Where cells reached beyond the box, a node could move a single layer of points, whose pairs to the next one
  /// `continued_shares` leaves out. points: (n + ghosts, d), of which the first n are owned; `fixed`: those take no part.
  PetscErrorCode create(MPI_Comm comm, int dim, PetscInt n, const std::vector<double>& points, const std::vector<std::uint8_t>& fixed,
                        PetscInt nodes);
  /// Local. Shares of other places of the same points, in the grid as it is.
  void place(const std::vector<double>& points, const std::vector<std::uint8_t>& fixed);
  PetscInt nodes() const { return nodes_; }
  /// The edge of a cell in direction c; infinite where there is one layer of nodes.
  double cell_size(int c) const { return count_[c] > 1 ? span_[c] / static_cast<double>(count_[c] - 1) : std::numeric_limits<double>::infinity(); }
  /// Collective. Whether it has cells in three dimensions, and points in more than half of them.
  PetscErrorCode fills_space(MPI_Comm comm, bool* yes) const;
  /// Owned points that take part.
  PetscInt particles() const { return particles_; }
  /// The lowest node of the cell point i is in; -1: it takes no part.
  PetscInt cell(PetscInt i) const { return cell_[static_cast<std::size_t>(i)]; }
  /// The 2^d nodes of a cell are cell + offset[k].
  template <int d>
  void offsets(PetscInt* offset) const noexcept;
  /// Point i's shares in them, which sum to 1.
  template <int d>
  void shares(PetscInt i, double* share) const noexcept;
  /// Shares of point j in the corners of point i's cell, whose hats are continued beyond it; false where j is further from i
  /// than half a cell, in any direction.
  template <int d>
  bool continued_shares(PetscInt i, PetscInt j, double* share) const noexcept;
  /// coarse_a = sum_i Z_ia r_i and z_i += sum_a Z_ia coarse_a over the owned points; r, z: (n, d), coarse: (nodes, d).
  void restrict_to(const double* r, double* coarse) const;
  void prolong(const double* coarse, double* z) const;

 private:
  template <int d>
  void restrict_of(const double* r, double* coarse) const;
  template <int d>
  void prolong_of(const double* coarse, double* z) const;
  int dim_ = 3;
  PetscInt n_ = 0, nodes_ = 0, particles_ = 0, count_[3] = {1, 1, 1};
  double low_[3] = {0, 0, 0}, span_[3] = {0, 0, 0};
  std::vector<std::int32_t> cell_;
  std::vector<float> fraction_;        ///< (n + ghosts, d): where in the cell, 0 to 1
  mutable std::vector<double> lanes_;  ///< room: (nodes, LANES<d>)
};

/// The hats as Galerkin wants them; a block of E has d rows of LANES<d> numbers. Where point j lies in another cell than i, but near, its shares in
/// the nodes of i's cell are taken: the same for motions that are linear over both cells, and E joins neighbouring nodes only. Stiff pairs do not
/// allow that: what they bear less in E than in S makes the coarse correction too large.
template <int d>
class HatColumns {
 public:
  static constexpr double MULTIPLY = d * d, ADD = 2 * d * d;
  struct Columns {
    static constexpr int MOST = 2 << d;
    int count = 0;
    PetscInt node[MOST];
    double z[MOST][d];  ///< diagonal blocks
  };
  struct Product {
    lanes::Vector<d> row[d];
  };
  HatColumns(const HatGrid& grid, const Graph& graph) : grid_(grid), graph_(graph) {
    grid.offsets<d>(offset_);
    for (int k = 0; k < 1 << d; ++k)  // where the system is flat, one of two corners at a node has no share
      if (std::find(offset_, offset_ + k, offset_[k]) == offset_ + k) corner_[corners_++] = k;
  }
  void columns(PetscInt i, double sign, Columns* to) const noexcept {
    double share[8];
    const PetscInt cell = grid_.cell(i);
    const std::uint8_t mask = graph_.mask(i);
    if (cell < 0) return;
    grid_.shares<d>(i, share);
    const int before = to->count;
    for (int m = 0; m < corners_; ++m) {
      const PetscInt node = cell + offset_[corner_[m]];
      int at = static_cast<int>(std::find(to->node, to->node + before, node) - to->node);
      if (at == before) {
        at = to->count++;
        to->node[at] = node;
        std::fill_n(to->z[at], d, 0.0);
      }
      for (int c = 0; c < d; ++c)
        if (!(mask >> c & 1)) to->z[at][c] += sign * share[corner_[m]];
    }
  }
  void difference(PetscInt i, PetscInt j, const Columns& own, bool stiff, Columns* both) const noexcept {
    double share[8], largest = 0;
    both->count = own.count;
    std::copy_n(own.node, own.count, both->node);
    if (stiff || graph_.mask(i) || graph_.mask(j) || !grid_.continued_shares<d>(i, j, share)) {
      std::copy_n(own.z[0], own.count * d, both->z[0]);
      columns(j, -1, both);
      return;
    }
    for (int m = 0; m < own.count; ++m) {
      const double left = own.z[m][0] - share[corner_[m]];
      largest = std::max(largest, std::abs(left));
      std::fill_n(both->z[m], d, left);
    }
    if (largest == 0) both->count = 0;  // tied to each other
  }
  static void multiply(const double* B, const Columns& c, int q, Product* Bz) noexcept {
    for (int r = 0; r < d; ++r) {
      lanes::Vector<d> row = {};
      for (int k = 0; k < d; ++k) row[k] = B[r * d + k] * c.z[q][k];
      Bz->row[r] = row;
    }
  }
  static void add(const Columns& c, int p, const Product& Bz, double* to) noexcept {
    for (int r = 0; r < d; ++r, to += LANES<d>) lanes::store<d>(lanes::load<d>(to) + lanes::splat<d>(c.z[p][r]) * Bz.row[r], to);
  }

 private:
  const HatGrid& grid_;
  const Graph& graph_;
  PetscInt offset_[8];
  int corner_[8], corners_ = 0;
};

}  // namespace bs
