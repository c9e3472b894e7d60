// The triple product E = Z^T S Z of a coarse space, pair by pair.
#pragma once
#include <algorithm>
#include "linalg/coarse_matrix.hpp"
#include "linalg/pair_matrix.hpp"

namespace bs {

/// `Z`, the coarse functions in d dimensions, has
///   Columns             those of a point or of the difference of two: `count` of at most MOST nodes `node[]`, each once, and their numbers
///   columns(i, sign, c) adds to them those of local point i, without rows of held components; fixed points have none
///   difference(i, j, own, stiff, c)  those of Z_i - Z_j, Z_i being `own`, of a pair that is much stiffer than others or not
///   multiply(B, c, q, Bz), add(c, p, Bz, to)   B Z_q for a d x d block B, and Z_p^T (B Z_q) added to a block of E
/// and the floating-point operations of these, MULTIPLY and ADD.
template <int d, class Z>
class Galerkin {
 public:
  /// `least`: the size above which pairs are stiff; 0: none is.
  Galerkin(const Z& z, double least, CoarseMatrix* E) : z_(z), least_(least), E_(*E) {}

  // E_ab = sum_i Z_ia^T A_i Z_ib + sum_ij (Z_ia - Z_ja)^T B_ij (Z_ib - Z_jb) + sum_ij Z_ia^T R_ij Z_jb,  a <= b, i and j not fixed
  void sum(const PairMatrix& S) {
    const PairPattern& pattern = S.pattern();
    typename Z::Columns own, both;
    for (PetscInt i = 0; i < pattern.n; ++i) {
      own.count = 0;
      z_.columns(i, 1, &own);
      if (own.count == 0) continue;
      add(own, S.node(i), own);
      for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) {
        const float* pair = S.pair(static_cast<std::size_t>(k));
        z_.difference(i, pattern.other[k], own, is_stiff(S, pair), &both);
        add_pair(pair, 1, both);
      }
      if (S.remainder().created())
        S.remainder().for_row(i, [&](PetscInt j, const double* R) {
          both.count = 0;
          z_.columns(j, 1, &both);
          add(own, R, both);
        });
    }
    for (std::size_t r = 0; r < pattern.cut_row.size(); ++r) {  // met on both ranks: half on each
      own.count = 0;
      z_.columns(pattern.cut_row[r], 1, &own);
      for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k) {
        const float* pair = S.cut(static_cast<std::size_t>(k));
        z_.difference(pattern.cut_row[r], pattern.n + pattern.ghost[k], own, is_stiff(S, pair), &both);
        add_pair(pair, 0.5, both);
      }
    }
  }
  double flops() const { return flops_; }

 private:
  static constexpr int MOST = Z::Columns::MOST;
  static constexpr std::size_t NONE = static_cast<std::size_t>(-1);

  bool is_stiff(const PairMatrix& S, const float* pair) const { return least_ > 0 && S.size_of(pair) > least_; }
  void add_pair(const float* pair, double part, const typename Z::Columns& both) {
    double B[d * d];
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c)
        B[r * d + c] = part * (static_cast<double>(pair[r]) * static_cast<double>(pair[c]) + (r == c ? static_cast<double>(pair[d]) : 0));
    add(both, B, both);
  }

  /// Neighbours in the order of points mostly have the same nodes: where their blocks are is kept.
  void find(const typename Z::Columns& rows, const typename Z::Columns& columns) {
    const bool same = rows.count == row_count_ && columns.count == column_count_ && std::equal(rows.node, rows.node + rows.count, row_) &&
                      std::equal(columns.node, columns.node + columns.count, column_);
    if (same) return;
    row_count_ = rows.count;
    column_count_ = columns.count;
    std::copy_n(rows.node, row_count_, row_);
    std::copy_n(columns.node, column_count_, column_);
    for (int p = 0; p < row_count_; ++p)
      for (int q = 0; q < column_count_; ++q) place_[p][q] = row_[p] <= column_[q] ? E_.place(row_[p], column_[q]) : NONE;
  }

  /// E_ab += Z_a^T B Z_b for a <= b.
  void add(const typename Z::Columns& rows, const double* B, const typename Z::Columns& columns) {
    typename Z::Product Bz;
    find(rows, columns);
    flops_ += Z::MULTIPLY * columns.count;
    for (int q = 0; q < columns.count; ++q) {
      z_.multiply(B, columns, q, &Bz);
      for (int p = 0; p < rows.count; ++p) {
        if (place_[p][q] == NONE) continue;
        z_.add(rows, p, Bz, E_.numbers(place_[p][q]));
        flops_ += Z::ADD;
      }
    }
  }

  const Z& z_;
  double least_;
  CoarseMatrix& E_;
  int row_count_ = 0, column_count_ = 0;
  PetscInt row_[MOST], column_[MOST];
  std::size_t place_[MOST][MOST];
  double flops_ = 0;
};

template <int d, class Z>
double add_galerkin(const PairMatrix& S, const Z& z, double least, CoarseMatrix* E) {
  Galerkin<d, Z> product(z, least, E);
  product.sum(S);
  return product.flops();
}

}  // namespace bs
