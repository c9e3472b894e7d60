// A second-order system linearised at one state, as the condensed solve sees it. With a = r_x (velocity form) or M^-1 r_x
// (momentum form) and r_v brought to momentum form, J (z_x, z_v) = (r_x, r_v) is
//   S w = r_v + (sigma M - D) a,   S = sigma M - D - K/sigma,   z_x = w/sigma,   z_v = w - a
// where K = df/dx, D = df/dv; or
//   S z_v = r_v + K a/sigma,   z_x = (z_v + a)/sigma
// which is more precise where dampers are strong and all moves alike: D M^-1/sigma times the rounding of a is then no error of z_v.
#pragma once
#include <petscmat.h>

namespace bs {

/// How matrices of d x d blocks are kept.
enum class CondensedStorage {
  springs,  ///< spring by spring, single precision, own kernels
  sbaij,
  baij,
  aij
};

/// Belongs to a model; renewed whenever the model's Jacobian is evaluated.
class Tangent {
 public:
  virtual ~Tangent() = default;
  /// Whether S as assembled, which is symmetric, holds all of J; else multiply_condensed includes what it leaves out.
  virtual bool exact_symmetric() const = 0;
  /// Whether every block of S comes from a pair of particles or from one; else the storage `springs` keeps a remainder.
  virtual bool pairwise() const { return true; }
  /// Whether masses make S better conditioned; at equilibria it is -K/sigma, and the signs of its pivots are looked at.
  virtual bool has_inertia() const { return true; }
  virtual double sigma() const = 0;
  /// Space dimension: block size of S.
  virtual int dim() const = 0;
  virtual MPI_Comm comm() const = 0;
  /// Global rows of S.
  virtual PetscInt unknowns() const = 0;
  /// Collective. y = J z, exactly, without a matrix.
  virtual PetscErrorCode multiply(Vec z, Vec y) = 0;
  /// Collective. The right-hand side of S w = b from r = (r_x, r_v).
  virtual PetscErrorCode condense(Vec r, Vec b) = 0;
  /// z from w and r.
  virtual PetscErrorCode expand(Vec r, Vec w, Vec z) = 0;
  /// Of every unknown of S, what rounding errors of its row of K/sigma are relative to (Pencil::stiffness_sizes), a vector of S.
  virtual PetscErrorCode stiffness_sizes(Vec s) = 0;
  /// Collective. A matrix for S, not yet assembled with values; with rigid body modes as near null space where it is AIJ.
  virtual PetscErrorCode create(CondensedStorage storage, Mat* S) = 0;
  /// Collective. Predicted floating-point operations of a sparse Cholesky factorisation of S, the same on any number of ranks. The graph is
  /// gathered on rank 0.
  virtual PetscErrorCode factor_flops(double* flops) = 0;
  /// Collective. The rigid body modes of an AIJ matrix become those of the present state; create() takes those of the start.
  virtual PetscErrorCode set_rigid_modes(Mat S) = 0;
  /// Collective. The symmetric part of S into a matrix made by create. `positive`: the negative transverse stiffness of springs
  /// under compression and what else may be negative are left out, which makes S positive definite.
  virtual PetscErrorCode assemble(bool positive, Mat S) = 0;
  /// Collective. y = S w exactly, with what the symmetric S of assemble leaves out; vectors of S.
  virtual PetscErrorCode multiply_condensed(Vec w, Vec y) = 0;
};

/// Ties a tangent to a matrix, for preconditioners to find; it must outlive the matrix's use.
PetscErrorCode attach_tangent(Mat P, Tangent* tangent);
/// The tangent tied to P; null: none.
Tangent* tangent_of(Mat P);

}  // namespace bs
