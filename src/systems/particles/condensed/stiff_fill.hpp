// Fill of the incomplete factors where springs are much stiffer than is usual.
#pragma once
#include "base/huge_pages.hpp"
#include "systems/particles/condensed/spring_matrix.hpp"

namespace bs {

/// The upper triangle of the factors by rows: those of the matrix's pattern in its order, then what is added.
struct FillPattern {
  HugeVector<PetscInt> start, other;
};

/// Elimination of a particle that two stiff springs tie to two others ties those as stiffly. Without a block for them the soft springs' part of the
/// pivots drowns in what is dropped, or the pivots are not positive definite. Adds the pairs (i, j) of upper neighbours of k that springs, or
/// such pairs, STIFF times stiffer than the mean of all springs (geometric) tie to k: all of them or, where these are `most` times the pairs or more,
/// none, since factors with a part of them are worse than without. False, and nothing is made, where no spring is that stiff, or too many are.
bool add_stiff_fill(const SpringMatrix& S, double most, FillPattern* out);

}  // namespace bs
