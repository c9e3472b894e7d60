// The preconditioner "condensed": positions are eliminated from a Newton correction, the velocities solved for,
//   S w = b,  S = sigma M - D - K/sigma
// by an inner KSP with the prefix condensed_. Half the unknowns and a symmetric matrix. With an exact inner solve it is the
// inverse of the Jacobian: the outer KSP is then preonly, and the outer tolerance is handed to the inner solve.
#pragma once
#include <petscts.h>
#include "model/tangent.hpp"

namespace bs {

struct CondensedCounts {
  PetscInt solves = 0, iterations = 0;  ///< of the inner KSP, fallbacks included
  PetscInt refreshed = 0;               ///< times the inner preconditioner was renewed
  PetscInt indefinite = 0;              ///< solves in which S turned out not to be positive definite
  PetscInt shifts = 0;                  ///< incomplete factorisations repeated with a larger diagonal
};

/// Registers the type "condensed" with PETSc; once, after PetscInitialize.
PetscErrorCode register_condensed();

/// Whether `pc` is of this type, and what it has done.
PetscErrorCode condensed_counts(PC pc, bool* is, CondensedCounts* counts);

/// Where the Jacobian comes from; must be given before `pc` is set up, unless P itself is tied to a tangent.
PetscErrorCode condensed_set_tangent(PC pc, Tangent* tangent);

/// Not collective. Whether `pc` is of this type and its inner factorisation failed for want of memory.
PetscErrorCode condensed_out_of_memory(PC pc, bool* yes);

/// The next solve renews the preconditioner, as the first one does: a run and its continuation then agree bit for bit.
PetscErrorCode condensed_renew(PC pc);

/// A few words on the inner solver in force (once it is set up).
PetscErrorCode condensed_describe(PC pc, std::string* text);

}  // namespace bs
