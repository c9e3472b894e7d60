// Incomplete Cholesky factors of S by d x d blocks, on the pairs' own pattern and the fill of stiff ones:
//   S ~ (D + U)^T D^-1 (D + U),  U_ij on the pairs i < j
// A registered preconditioner ("bicc") for matrices of pairs; each rank factors its own part, which overlaps with others' where a stiff pair is
// cut; with rigid motions beside it, whose products with S cost more than what is sent, at all cut pairs.
#pragma once
#include <petscpc.h>
#include <memory>
#include "linalg/overlap.hpp"
#include "linalg/pair_matrix.hpp"

namespace bs {

/// Factors in one precision; chosen by dimension and precision once. Rows are the owned points and those of the overlap.
class BlockFactor {
 public:
  virtual ~BlockFactor() = default;
  /// Collective. The pattern, by the pairs as they are now, with fill of stiff ones up to `most` times the blocks of S; it stays. `everywhere`: where
  /// none are stiff, ranks overlap at all pairs.
  virtual PetscErrorCode lay_out(PairMatrix& S, double most, bool everywhere) = 0;
  /// The rows behind those of the owned points.
  virtual Overlap& overlap() = 0;
  /// Factors S with shift times the size of each diagonal block added to its diagonal; `diagonal`: S's diagonal blocks, of all rows.
  /// False where a pivot is not positive definite.
  virtual bool factor(const PairMatrix& S, const std::vector<double>& diagonal, double shift) = 0;
  /// Floating-point operations of the last factorisation.
  virtual double flops() const = 0;
  /// d x d blocks of the factors.
  virtual double blocks() const = 0;
  /// Solves with the factors; r and z: (rows, d).
  virtual void solve(const double* r, double* z) = 0;
};

/// `single_precision`: factors kept in single precision, sums in double. Stiffness ratios beyond about 1e5 need double.
std::unique_ptr<BlockFactor> create_block_factor(int dim, bool single_precision);

/// What the next set-up keeps of the last one: nothing, so that it depends on the matrix alone; what was chosen for an earlier matrix (the factors'
/// pattern and precision, the kind of coarse space); or the coarse space itself, too.
enum class KeptParts { none, choices, coarse_space };

/// Registers the type "bicc" with PETSc; once, after PetscInitialize. A PC of it composes "BSKeepParts_C", a function PetscErrorCode (PC, KeptParts),
/// without which set-ups keep the choices; "BSFactorShifts_C", a function
/// PetscErrorCode (PC, PetscInt* count): the shifts its factorisations have needed so far, and "BSCoarseDescription_C", PetscErrorCode
/// (PC, const char** words): what its coarse space consists of where that is not hats, or an empty text; collective.
PetscErrorCode register_block_icc();

}  // namespace bs
