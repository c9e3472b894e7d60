// The preconditioner "condensed": positions are eliminated from a Newton correction, the velocities solved for,
//   S w = b,  S = sigma M - D - K/sigma
// by an inner KSP with the prefix condensed_. Half the unknowns and a symmetric matrix. With an exact inner solve it is the
// inverse of the Jacobian: the outer KSP is then preonly, and the outer tolerance is handed to the inner solve.
#pragma once
#include <petscksp.h>
#include <string>
#include "linalg/condensed/tangent.hpp"

namespace bs {

/// Which S a Newton direction is taken from.
enum class Curvature { automatic, exact, definite };

/// What the solve is for.
struct CondensedDemand {
  /// A descent direction of the step's potential is enough (the energy search makes the most of it); else S w = b is solved
  /// whether S is definite or not.
  bool direction = false;
  /// For directions: exact: S as it is; definite: with what makes it positive definite; automatic: as it is while it is
  /// positive definite, then with the absolute values of its curvatures.
  Curvature curvature = Curvature::automatic;
  /// The signs of the pivots are wanted, where the solver is direct; they always are for directions.
  bool inertia = false;
};

struct CondensedCounts {
  PetscInt solves = 0, iterations = 0;  ///< of the inner KSP, fallbacks included
  PetscInt refreshed = 0;               ///< times the inner preconditioner was renewed
  PetscInt indefinite = 0;              ///< solves in which S turned out not to be positive definite
  PetscInt definite = 0;                ///< solves with the definite part of S in its place
  PetscInt unfinished = 0;              ///< directions taken when the iterations ran out
  PetscInt exhausted = 0;               ///< solves that failed because the iterations ran out
  PetscInt broken = 0;                  ///< solves that broke down for another reason than an indefinite S
  PetscInt factored = 0;                ///< times factors took the place of iterations, which took more work
  PetscInt shifts = 0;                  ///< incomplete factorisations repeated with a larger diagonal
};

/// Registers the type "condensed" with PETSc; once, after PetscInitialize.
PetscErrorCode register_condensed();

/// Whether `pc` is of this type, and what it has done.
PetscErrorCode condensed_counts(PC pc, bool* is, CondensedCounts* counts);

/// The tangent behind the Jacobian, and what the solves are for; to be given before `pc` is set up, unless P itself is tied to a tangent. The demand
/// may change between solves, except whether the signs of the pivots are wanted.
PetscErrorCode condensed_set_tangent(PC pc, Tangent* tangent, const CondensedDemand& demand);

/// The demand given last; for a `pc` of another type `demand` stays as it is.
PetscErrorCode condensed_demand(PC pc, CondensedDemand* demand);

/// Not collective. Why the last solve of a `pc` of this type failed; empty where it succeeded, or where S was not positive definite.
PetscErrorCode condensed_failure(PC pc, std::string* text);

/// The next solve renews the preconditioner, as the first one does: a run and its continuation then agree bit for bit.
PetscErrorCode condensed_renew(PC pc);

/// From now on Newton's directions by a direct solver may come from iterations with factors of an earlier S, as long as few are enough; or no longer.
PetscErrorCode condensed_reuse_factors(PC pc, bool yes);

/// Collective. Creates the inner solver of a `pc` of this type, whose options it reads; the first set-up does it otherwise.
PetscErrorCode condensed_create_inner(PC pc);

/// Curvatures along z between 0 and minus this times the sum of s_i |z_i|^2 are rounding errors, where s_i is the stiffness of all that acts on the
/// point i, however much softer or stiffer other parts are.
inline constexpr double CURVATURE_DOUBT = 1e-12;

/// Collective. How many negative eigenvalues S has at the tangent's present state, beyond CURVATURE_DOUBT; -1: `pc` is not of this type, or its
/// solver does not tell.
PetscErrorCode condensed_negative_pivots(PC pc, PetscInt* count);

/// Collective. Where it does not: looks by at most `most` iterations that begin with the load r, laid out as a residual, for a direction z of states
/// with z.S z <= 0. found: false where there was none.
PetscErrorCode condensed_negative_direction(PC pc, Vec r, PetscInt most, Vec z, bool* found);

/// Collective. J z = r by the definite part of S at the tangent's present state, to `rtol` of the condensed r, whatever the demand of other solves; a
/// `pc` of this type. Its iterations are counted, its solve is none of Newton's directions. solved: false leaves z open.
PetscErrorCode condensed_solve_definite(PC pc, double rtol, Vec r, Vec z, bool* solved);

/// A few words on the inner solver in force; empty before it is created.
PetscErrorCode condensed_describe(PC pc, std::string* text);

/// Whether small systems are solved directly, where the user left the inner solver open.
struct DirectChoice {
  bool direct = false;
  double flops = -1;  ///< predicted of one Cholesky factorisation of S; negative: too large a system to be counted
  /// The reason in a few words.
  std::string words() const;
};

/// Collective. A sparse direct method for S, or an iterative one: by the predicted work of its factors; the same on any number of ranks.
PetscErrorCode choose_direct(Tangent& tangent, DirectChoice* choice);

}  // namespace bs
