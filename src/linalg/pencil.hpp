// The matrix pencil a M - b D - c K of a second-order system M x'' = f(t, x, v) linearised at one state, K = df/dx, D = df/dv, as linear algebra
// sees it: points with d unknowns each, of which some components are held. M is diagonal.
#pragma once
#include <petscmat.h>
#include <vector>
#include "linalg/condensed/tangent.hpp"

namespace bs {

/// Coefficients of the matrix a M - b D - c K.
struct Coefficients {
  double mass = 0, damping = 0, stiffness = 0;  ///< a, b, c
  bool operator==(const Coefficients& other) const { return mass == other.mass && damping == other.damping && stiffness == other.stiffness; }
};

class Pencil {
 public:
  virtual ~Pencil() = default;
  virtual MPI_Comm comm() const = 0;
  /// The dimension d, and the number of points that this rank owns.
  virtual PetscInt dim() const = 0;
  virtual PetscInt points() const = 0;
  /// Global number of unknowns: d for each point, held ones included.
  virtual PetscInt unknowns() const = 0;
  /// Masses of the owned points [kg], (n) or longer; fixed ones have theirs, too.
  virtual const std::vector<double>& masses() const = 0;
  /// Positions of the owned points in the state at which the system is linearised, (n, d) [m].
  virtual std::vector<double> positions() const = 0;
  /// Whether component c of owned point i can move.
  virtual bool moves(PetscInt i, PetscInt c) const = 0;
  /// Whether every force acts between two points, so that the storage by springs holds the matrix without a sparse remainder.
  virtual bool pairwise() const = 0;
  /// size (n): the sum of the magnitudes of all stiffnesses that act on each owned point, whatever their directions [N/m]. Rounding errors in its
  /// rows of K are this times the machine precision.
  virtual void stiffness_sizes(double* size) = 0;
  /// Collective. Creates a matrix of d x d blocks for a M - b D - c K, without values; a matrix of type AIJ gets the rigid body modes as its near
  /// null space.
  virtual PetscErrorCode create(CondensedStorage storage, Mat* S) = 0;
  /// Collective. Fills a matrix made by create() with the symmetric part of a M - b D - c K. `positive`: without the terms that may make it
  /// indefinite, mainly the negative transverse stiffness of compressed springs.
  virtual PetscErrorCode assemble(const Coefficients& coefficients, bool positive, Mat S) = 0;
  /// Collective. out = (a M - b D - c K) z exactly, without a matrix; z, out: blocks of d.
  virtual PetscErrorCode multiply(const Coefficients& coefficients, Vec z, Vec out) = 0;
};

}  // namespace bs
