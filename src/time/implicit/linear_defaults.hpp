// The program's own choice of KSP and PC, where the user left them open.
#pragma once
#include <petscts.h>
#include "solvers/newton/convergence.hpp"
#include "systems/model.hpp"

namespace bs {

/// Collective. Whether the Jacobian must be held as a matrix: something will look at its entries, or it is small enough to
/// make no difference. Reads -bs_operator.
PetscErrorCode needs_matrix(Model& model, bool* yes);

/// Collective. Before the options are read: linear models LU, particle systems the condensed solve, those that all couple
/// with all LU or GMRES; nothing under -snes_mf, which has no matrix. Newton loosens the tolerance of iterative solves.
PetscErrorCode set_linear_defaults(TS ts, Model& model, NewtonPolicy* newton);

/// Adds what the condensed solve has counted, where it is in force.
PetscErrorCode solver_tallies(TS ts, std::vector<Tally>* out);

}  // namespace bs
