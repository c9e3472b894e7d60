// E = Z^T S Z of a coarse grid, pair by pair.
#pragma once
#include <algorithm>
#include <cstring>
#include <vector>
#include "linalg/coarse_factors.hpp"
#include "linalg/hat_grid.hpp"
#include "linalg/lanes.hpp"
#include "linalg/pair_matrix.hpp"

namespace bs {

/// Sums symmetric d x d blocks into E: the rows of a block's upper triangle in the first d (d+1)/2 of WIDTH numbers. What points add that are held in
/// part, whose blocks lack rows and columns, goes into d x d blocks of their own.
template <int d>
class HatMatrix {
 public:
  static constexpr int CORNERS = 1 << d;
  static constexpr std::size_t WIDTH = 8;
  typedef typename lanes::Register<double, WIDTH>::type Block;

  HatMatrix(const HatGrid& grid, CoarseBlocks* E, CoarseBlocks* full) : grid_(grid), E_(*E), full_(*full) { grid.offsets<d>(offset_); }

  // E_ab = sum_i Z_ia A_i Z_ib + sum_ij (Z_ia - Z_ja) B_ij (Z_ib - Z_jb),  i and j not fixed
  // Z_ia: share of point i in node a, as a diagonal matrix whose entries of held components are 0. Where point j lies in another cell
  // than i, but near, its shares in the nodes of i's cell are taken: the same for motions that are linear over both cells, and E has
  // blocks between neighbouring nodes only.
  void sum(const PairMatrix& S) {
    const PairPattern& pattern = S.pattern();
    graph_ = &S.graph();
    for (PetscInt i = 0; i < pattern.n; ++i) {
      if (grid_.cell(i) < 0) continue;
      enter(grid_.cell(i));
      place(i, 0, 1);
      const double* A = S.node(i);
      if (held(i)) add_held(CORNERS, A, 1);
      else add_here(packed([A](int r, int c) { return A[r * d + c]; }));
      for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) add_pair(i, pattern.other[k], S.pair(static_cast<std::size_t>(k)), 1);
    }
    for (std::size_t r = 0; r < pattern.cut_row.size(); ++r) {  // met on both ranks: half on each
      enter(grid_.cell(pattern.cut_row[r]));
      for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k)
        add_pair(pattern.cut_row[r], pattern.n + pattern.ghost[k], S.cut(static_cast<std::size_t>(k)), 0.5);
    }
    enter(-1);
    if (S.remainder().created()) add_remainder(S);
  }

  /// Floating-point operations of the sum: of each pair of corners a product of shares, and its product with the upper triangle, added.
  double flops() const noexcept { return (1.0 + d * (d + 1)) * updates_; }

 private:
  template <class Entry>
  static Block packed(Entry entry) noexcept {
    Block B = {};
    for (int r = 0, k = 0; r < d; ++r)
      for (int c = r; c < d; ++c) B[k++] = entry(r, c);
    return B;
  }
  void place(PetscInt i, int from, double sign) noexcept {
    grid_.shares<d>(i, share_ + from);
    for (int k = 0; k < CORNERS; ++k) {
      node_[from + k] = grid_.cell(i) + offset_[k];
      share_[from + k] *= sign;
      held_[from + k] = held(i);
    }
  }
  void add_pair(PetscInt i, PetscInt j, const float* pair, double part) {
    const bool holds = held(i) || held(j);
    place(i, 0, 1);
    if (!holds && grid_.continued_shares<d>(i, j, share_ + CORNERS)) {
      double largest = 0;
      for (int k = 0; k < CORNERS; ++k) largest = std::max(largest, std::abs(share_[k] -= share_[CORNERS + k]));
      if (largest > 0) add_here(pair_block(pair, part));  // else tied to each other
      return;
    }
    place(j, CORNERS, -1);
    if (!holds) {
      add_anywhere(pair_block(pair, part));
      return;
    }
    double B[d * d];
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c)
        B[r * d + c] = static_cast<double>(pair[r]) * static_cast<double>(pair[c]) + (r == c ? static_cast<double>(pair[d]) : 0);
    add_held(2 * CORNERS, B, part);
  }
  static Block pair_block(const float* pair, double part) noexcept {
    return packed([=](int r, int c) {
      const double across = r == c ? static_cast<double>(pair[d]) : 0;
      return part * (static_cast<double>(pair[r]) * static_cast<double>(pair[c]) + across);
    });
  }

  /// Into the blocks of the cell that was entered, of corners p <= q, which go into E when it is left: neighbours in the order of
  /// points are mostly in one cell.
  void add_here(const Block& B) noexcept {
    updates_ += 0.5 * CORNERS * (CORNERS + 1);
    for (int p = 0; p < CORNERS; ++p) {
      const Block part = B * share_[p];
      for (int q = p; q < CORNERS; ++q) here_[p][q] += part * share_[q];
    }
  }
  void enter(PetscInt cell) {
    if (cell == cell_) return;
    for (int p = 0; p < CORNERS && cell_ >= 0; ++p)
      for (int q = p; q < CORNERS; ++q) {
        add_block(cell_ + offset_[p], cell_ + offset_[q], here_[p][q]);  // where the system is flat, one of two corners at a node has no share
        here_[p][q] = Block{};
      }
    cell_ = cell;
  }
  void add_anywhere(const Block& B) {
    updates_ += CORNERS * (2 * CORNERS + 1);
    for (int p = 0; p < 2 * CORNERS; ++p)
      for (int q = p; q < 2 * CORNERS; ++q) add_block(node_[p], node_[q], B * (share_[p] * share_[q] * (p != q && node_[p] == node_[q] ? 2 : 1)));
  }
  void add_block(PetscInt a, PetscInt b, const Block& B) {
    double* at = E_.at(std::min(a, b), std::max(a, b));
    Block sum;
    std::memcpy(&sum, at, sizeof sum);
    sum += B;
    std::memcpy(at, &sum, sizeof sum);
  }

  /// Blocks of a pair with a point that is held in part are not symmetric: all of them, entry by entry.
  void add_held(int entries, const double* B, double part) {
    updates_ += 2.0 * entries * entries;  // twice the numbers of an upper triangle, of all pairs
    for (int p = 0; p < entries; ++p)
      for (int q = 0; q < entries; ++q) {
        if (node_[p] <= node_[q]) add_full(p, q, part * share_[p] * share_[q], B);
      }
  }
  // E_ab += sum_ij Z_ia R_ij Z_jb,  a <= b: the others come from R_ji
  void add_remainder(const PairMatrix& S) {
    for (PetscInt i = 0; i < S.pattern().n; ++i) {
      if (grid_.cell(i) < 0) continue;
      place(i, 0, 1);
      S.remainder().for_row(i, [this](PetscInt j, const double* R) {
        place(j, CORNERS, 1);
        updates_ += CORNERS * CORNERS;
        for (int p = 0; p < CORNERS; ++p)
          for (int q = CORNERS; q < 2 * CORNERS; ++q)
            if (node_[p] <= node_[q] && share_[p] * share_[q] > 0) add_full(p, q, share_[p] * share_[q], R);
      });
    }
  }
  void add_full(int p, int q, double factor, const double* B) {
    double* to = full_.at(node_[p], node_[q]);
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c)
        if (!(held_[p] >> r & 1) && !(held_[q] >> c & 1)) to[r * d + c] += factor * B[r * d + c];
  }
  std::uint8_t held(PetscInt i) const noexcept { return graph_->mask(i); }

  Block here_[CORNERS][CORNERS] = {};
  const HatGrid& grid_;
  CoarseBlocks &E_, &full_;
  PetscInt cell_ = -1;  ///< whose blocks here_ holds
  const Graph* graph_ = nullptr;
  double updates_ = 0;
  PetscInt offset_[CORNERS] = {}, node_[2 * CORNERS] = {};
  double share_[2 * CORNERS + 8] = {};
  std::uint8_t held_[2 * CORNERS] = {};
};

}  // namespace bs
