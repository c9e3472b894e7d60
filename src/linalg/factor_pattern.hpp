// Which blocks the incomplete factors hold: those of S, and fill where pairs are much stiffer than is usual.
#pragma once
#include <vector>
#include "base/arrays.hpp"
#include "linalg/overlap.hpp"
#include "linalg/pair_matrix.hpp"

namespace bs {

/// The upper triangle of the factors, by rows in the order in which they are eliminated. A row is an owned point, or behind these a ghost of the
/// overlap.
struct FactorPattern {
  std::vector<PetscInt> order, turn;  ///< the row that is eliminated as k-th, and when row i is; empty: in their own order
  HugeVector<PetscInt> start, other;  ///< compressed rows, ascending, of these turns
  HugeVector<PetscInt> place;         ///< of every block that for_each_pair() visits
  bool made() const { return !start.empty(); }
  PetscInt turn_of(PetscInt row) const { return turn.empty() ? row : turn[static_cast<std::size_t>(row)]; }
  /// Of the block in the row of turn i and the column of turn j > i, which must be there.
  PetscInt find(PetscInt i, PetscInt j) const;
};

/// visit(i, j, numbers): the pairs between rows i < j, in the pattern's order those of each owned point, then those cut by the rank boundary whose
/// ghost is a row, and after all points the ties of ghosts.
template <class Visit>
void for_each_pair(const PairMatrix& S, const Overlap& overlap, Visit&& visit) {
  const PairPattern& pattern = S.pattern();
  std::size_t cut = 0;
  for (PetscInt i = 0; i < pattern.n; ++i) {
    for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) visit(i, pattern.other[k], S.pair(static_cast<std::size_t>(k)));
    if (cut == pattern.cut_row.size() || pattern.cut_row[cut] != i) continue;
    for (PetscInt k = pattern.cut_start[cut]; k < pattern.cut_start[cut + 1]; ++k)
      if (overlap.row(pattern.ghost[k]) >= 0) visit(i, overlap.row(pattern.ghost[k]), S.cut(static_cast<std::size_t>(k)));
    ++cut;
  }
  for (const Overlap::Tie& tie : overlap.ties()) visit(tie.a, tie.b, tie.numbers);
}

/// Collective. The size of a pair above which it is stiff: STIFF times the mean (geometric), where some pair is UNEVEN times as large; 0 elsewhere.
PetscErrorCode least_stiff_size(const PairMatrix& S, double* least);

/// Elimination of a point that two stiff pairs tie to two others ties those as stiffly. Without a block for them the soft pairs' part of the
/// pivots drowns in what is dropped, or the pivots are not positive definite. Adds the pairs (i, j) of rows after k that pairs, or such pairs, of a
/// size above `least` tie to k, with the rows in an order that leaves few of them where their own leaves many: all of them or, where these are `most`
/// times the blocks of S or more, none, since factors with a part of them are worse than without; the rows of the overlap are left out then, as where
/// no pair is that stiff. Nothing is made where the pairs of S are all there is.
PetscErrorCode make_factor_pattern(const PairMatrix& S, double least, double most, Overlap* overlap, FactorPattern* out);

}  // namespace bs
