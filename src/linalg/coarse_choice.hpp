// Which coarse functions suit a system: hats on a grid or rigid motions of groups of points.
#pragma once
#include "linalg/pair_matrix.hpp"

namespace bs {

/// Collective. Whether rigid motions of groups suit it better, by its points and pairs as they start:
/// - it is at least THIN times as long as it is thick, so that it bends, which hats resist much too strongly; not a line, which incomplete factors
///   solve;
/// - its stiffnesses differ by UNEVEN at most: motions of groups would strain stiff pairs between them;
/// - its pairs resist every uniform strain, or nothing else acts: where bending of lines resists a shear that pairs do not, cross-sections move
///   past each other without turning, as hats do and groups do not.
PetscErrorCode prefers_rigid_motions(const PairMatrix& S, bool* rigid);

/// Collective. How well pairs of equal stiffness at the places they start at resist uniform strains, in the directions they lie in: the energy of the
/// least resisted strain over that of the most resisted one; 0.4 for directions at random, 0 for a square or simple cubic lattice.
PetscErrorCode least_resisted_strain(const PairMatrix& S, double* ratio);

}  // namespace bs
