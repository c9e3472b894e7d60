// E = Z^T S Z of a coarse grid, spring by spring.
#pragma once
#include <algorithm>
#include <cstring>
#include <vector>
#include "systems/particles/condensed/coarse_grid.hpp"
#include "systems/particles/condensed/lanes.hpp"
#include "systems/particles/condensed/spring_matrix.hpp"
#include "systems/particles/supports.hpp"

namespace bs {

/// Sums symmetric d x d blocks into E: the upper triangle of a block in the first d (d+1)/2 of 8 numbers, blocks (a, b)
/// with a <= b in a (nodes, nodes) table. What rollers add, whose blocks lack rows and columns, goes into a table of all of E's entries.
template <int d>
class CoarseEnergy {
 public:
  static constexpr int CORNERS = 1 << d;
  typedef typename lanes::Register<double, 8>::type Block;

  /// `rolling`: ((nodes d)^2), empty where there are no rollers.
  CoarseEnergy(const CoarseGrid& grid, std::vector<double>* E, std::vector<double>* rolling) : grid_(grid), E_(E->data()), rolling_(*rolling) {
    grid.offsets<d>(offset_);
  }

  // E_ab = sum_i Z_ia A_i Z_ib + sum_ij (Z_ia - Z_ja) B_ij (Z_ib - Z_jb),  i and j not fixed
  // Z_ia: share of particle i in node a, as a diagonal matrix whose entries of held components are 0
  void sum(const SpringMatrix& S) {
    const SpringPattern& pattern = S.pattern();
    find_rollers(S.network());
    for (PetscInt i = 0; i < pattern.n; ++i) {
      if (grid_.cell(i) < 0) continue;
      place(i, 0, 1);
      const double* A = S.node(i);
      if (held(i)) add_held(CORNERS, A, 1);
      else add(CORNERS, packed([A](int r, int c) { return A[r * d + c]; }));
      for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) add_pair(i, pattern.other[k], S.pair(static_cast<std::size_t>(k)), 1);
    }
    for (std::size_t r = 0; r < pattern.cut_row.size(); ++r)  // met on both ranks: half on each
      for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k)
        add_pair(pattern.cut_row[r], pattern.n + pattern.ghost[k], S.cut(static_cast<std::size_t>(k)), 0.5);
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
  void add_pair(PetscInt i, PetscInt j, const float* pair, double part) noexcept {
    place(i, 0, 1);
    place(j, CORNERS, -1);
    if (held(i) || held(j)) {
      double B[d * d];
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c)
          B[r * d + c] = static_cast<double>(pair[r]) * static_cast<double>(pair[c]) + (r == c ? static_cast<double>(pair[d]) : 0);
      add_held(2 * CORNERS, B, part);
      return;
    }
    int entries = 2 * CORNERS;
    if (grid_.cell(i) == grid_.cell(j)) {
      double largest = 0;
      for (int k = 0; k < CORNERS; ++k) largest = std::max(largest, std::abs(share_[k] += share_[CORNERS + k]));
      if (largest == 0) return;  // tied to each other
      entries = CORNERS;
    }
    add(entries, packed([=](int r, int c) {
          const double across = r == c ? static_cast<double>(pair[d]) : 0;
          return part * (static_cast<double>(pair[r]) * static_cast<double>(pair[c]) + across);
        }));
  }
  void add(int entries, const Block& B) noexcept {
    updates_ += 0.5 * entries * (entries + 1);
    for (int p = 0; p < entries; ++p)
      for (int q = p; q < entries; ++q) {
        const double both = share_[p] * share_[q] * (p != q && node_[p] == node_[q] ? 2 : 1);
        double* at = E_ + 8 * (static_cast<std::size_t>(std::min(node_[p], node_[q])) * static_cast<std::size_t>(grid_.nodes()) +
                               static_cast<std::size_t>(std::max(node_[p], node_[q])));
        Block sum;
        std::memcpy(&sum, at, sizeof sum);
        sum += B * both;
        std::memcpy(at, &sum, sizeof sum);
      }
  }

  /// Blocks of a spring at a roller are not symmetric: all of them, entry by entry.
  void add_held(int entries, const double* B, double part) noexcept {
    const std::size_t size = static_cast<std::size_t>(grid_.nodes()) * d;
    updates_ += 2.0 * entries * entries;  // twice the numbers of an upper triangle, of all pairs
    for (int p = 0; p < entries; ++p)
      for (int q = 0; q < entries; ++q)
        for (int r = 0; r < d; ++r)
          for (int c = 0; c < d; ++c)
            if (!(held_[p] >> r & 1) && !(held_[q] >> c & 1))
              rolling_[(static_cast<std::size_t>(node_[p]) * d + r) * size + static_cast<std::size_t>(node_[q]) * d + c] +=
                  part * share_[p] * share_[q] * B[r * d + c];
  }
  void find_rollers(const Network& net) {
    if (rolling_.empty()) return;
    mask_.resize(net.fixed.size());
    for (std::size_t i = 0; i < mask_.size(); ++i) mask_[i] = net.supports->rolling(net.global[i]);
  }
  std::uint8_t held(PetscInt i) const noexcept { return mask_.empty() ? 0 : mask_[static_cast<std::size_t>(i)]; }

  const CoarseGrid& grid_;
  double* E_;
  std::vector<double>& rolling_;
  std::vector<std::uint8_t> mask_;  ///< held components of owned particles and ghosts
  std::uint8_t held_[2 * CORNERS] = {};
  double updates_ = 0;
  PetscInt offset_[CORNERS] = {}, node_[2 * CORNERS] = {};
  double share_[2 * CORNERS + 8] = {};
};

}  // namespace bs
