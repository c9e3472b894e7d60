// Which blocks the incomplete factors hold: those of S, and fill where pairs are much stiffer than is usual.
#pragma once
#include "base/arrays.hpp"
#include "linalg/overlap.hpp"
#include "linalg/pair_matrix.hpp"

namespace bs {

/// The upper triangle of the factors by rows. Of an owned point: the pairs of the matrix's pattern in its order, those cut by the rank boundary
/// whose ghost is a row, those that R alone joins, then fill. Of a ghost: its ties, then fill.
struct FactorPattern {
  HugeVector<PetscInt> start, other;
};

/// The size of a pair above which it is stiff: STIFF times the mean of this rank (geometric). 0 where none is.
double least_stiff_size(const PairMatrix& S);

/// Elimination of a point that two stiff pairs tie to two others ties those as stiffly. Without a block for them the soft pairs' part of the
/// pivots drowns in what is dropped, or the pivots are not positive definite. Adds the pairs (i, j) of upper neighbours of k that pairs, or
/// such pairs, of a size above `least` tie to k: all of them or, where these are `most` times the blocks of S or more, none, since factors with a
/// part of them are worse than without; the rows of the overlap are left out then, as where no pair is that stiff. False, and nothing is
/// made, where the pairs of S are all there is.
bool make_factor_pattern(const PairMatrix& S, double least, double most, Overlap* overlap, FactorPattern* out);

}  // namespace bs
