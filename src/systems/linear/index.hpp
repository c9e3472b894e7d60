// The index of a descriptor system G x + C x' = B u: whether its algebraic equations determine their unknowns.
#pragma once
#include <petscmat.h>
#include <vector>

namespace bs {

/// Result of the analysis of the index of a pencil (G, C).
struct PencilIndex {
  bool higher = false;         ///< it is 2 or more
  std::vector<PetscInt> rows;  ///< (up to 3, ascending, from 0) rows with most part in what is missing; empty for large systems
};

/// Collective; the same on every rank. With bases W, N of the left and right null space of C the index is 0 or 1 just where W'G N is
/// regular. `higher` stays false where this test is too expensive: beyond 100,000 states, or where C couples more than 300 rows with
/// each other.
PetscErrorCode find_index(Mat G, Mat C, PencilIndex* out);

}  // namespace bs
