// Set-up of the linear solver before the first step: whether its factors can be computed and the system is regular.
#pragma once
#include <petscts.h>
#include "solvers/newton/convergence.hpp"
#include "systems/model.hpp"
#include "time/ts_setup.hpp"

namespace bs {

/// Collective. The Jacobian at the state and time `ts` is at, for a step of h [s], becomes the linear solver's matrix, and its
/// factors are made; nothing under -snes_mf, which has no matrix.
PetscErrorCode factor_first_matrix(TS ts, TSContext& context, double h);

/// Collective. Whether the solvers are to be set up before the first step: for the sake of options that inner solvers have still to
/// read (`unread`), of blocks with solvers of their own, of a choice of the user's that may not work, or of a linear
/// system, which may be singular.
PetscErrorCode wants_solvers_early(TS ts, const TSContext& context, bool unread, bool* wants);

/// Collective. Sets SNES, KSP and PC up with the first matrix, those of blocks included.
PetscErrorCode set_up_solvers(TS ts, TSContext& context);

/// Collective, once the solvers are set up. Ends the run with exit code 2 if the model finds the first matrix singular.
PetscErrorCode check_first_matrix(TS ts, TSContext& context);

// The program's own choice of KSP and PC, where the user left them open.

/// Collective. Whether the Jacobian must be held as a matrix: something will look at its entries, or it is small enough to
/// make no difference. Reads -bs_operator.
PetscErrorCode needs_matrix(Model& model, bool* yes);

/// Collective. Before the options are read: linear models LU, particle systems the condensed solve, those that all couple
/// with all LU or GMRES; nothing under -snes_mf, which has no matrix. Newton loosens the tolerance of iterative solves.
PetscErrorCode set_linear_defaults(TS ts, Model& model, NewtonPolicy* newton);

/// Adds what the condensed solve has counted, where it is in force.
PetscErrorCode solver_tallies(TS ts, std::vector<Tally>* out);

}  // namespace bs
