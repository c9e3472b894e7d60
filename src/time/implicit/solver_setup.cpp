#include "time/implicit/solver_setup.hpp"
#include <string>
#include "base/collective.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "linalg/condensed/condensed.hpp"
#include "linalg/solver_options.hpp"
#include "systems/layout.hpp"
#include "time/implicit/linear_reuse.hpp"
#include "time/methods.hpp"

namespace bs {

namespace {

/// The linear solver that has a matrix to be set up with; null under -snes_mf.
PetscErrorCode solver_with_matrix(TS ts, KSP* ksp) {
  SNES snes;
  Mat P;
  PetscBool matrix_free = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetJacobian(snes, nullptr, &P, nullptr, nullptr));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(P), MATMFFD, &matrix_free));
  *ksp = nullptr;
  if (!matrix_free) PetscCall(linear_solver_of(ts, ksp, nullptr));
  PetscFunctionReturn(0);
}

/// Whether solvers of the user's own choice are worth setting up to see if they can be: what cannot work, some pair of
/// matrix and preconditioner, is then refused before the first frame.
PetscErrorCode worth_trying(PC pc, const TSContext& context, bool* yes) {
  constexpr PetscInt MOST = 60000;  // unknowns; above them the set-up may take long, and is left to the first step
  PetscInt unknowns = 0;
  CondensedCounts counts;
  bool condensed = false;
  PetscFunctionBegin;
  *yes = false;
  PetscCall(condensed_counts(pc, &condensed, &counts));
  if (condensed) PetscFunctionReturn(0);  // the age of its factors counts from their set-up
  PetscCall(VecGetSize(context.model->initial_state(), &unknowns));
  for (const char* name : {"-pc_type", "-ksp_type", "-mat_type", "-snes_type"}) *yes = *yes || (is_given(name) && unknowns <= MOST);
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode wants_solvers_early(TS ts, const TSContext& context, bool unread, bool* wants) {
  PC pc;
  bool blocks = false, own_choice = false;
  PetscFunctionBegin;
  *wants = false;
  if (!context.implicit) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(has_blocks(pc, &blocks));
  PetscCall(worth_trying(pc, context, &own_choice));
  *wants = unread || own_choice || context.model->linear() || blocks;
  PetscFunctionReturn(0);
}

PetscErrorCode factor_first_matrix(TS ts, TSContext& context, double h) {
  SNES snes;
  KSP ksp;
  Vec y;
  PetscReal t;
  double sigma;
  VecHandle zero;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(TSGetSolution(ts, &y));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(shift_of_step(ts, h, &sigma));
  PetscCall(VecDuplicate(y, zero.out()));
  PetscCall(VecZeroEntries(zero));
  PetscCall(SNESSetSolution(snes, zero));  // some types make their vectors like it
  PetscCall(SNESSetUp(snes));
  PetscCall(solver_with_matrix(ts, &ksp));
  if (!ksp) PetscFunctionReturn(0);
  PetscCall(context.model->jacobian(t, y, zero, sigma, context.form, context.matrix));
  PetscCall(KSPSetOperators(ksp, context.operator_, context.matrix));
  PetscCall(KSPSetUp(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode set_up_solvers(TS ts, TSContext& context) {
  KSP ksp;
  PC pc;
  PetscReal h;
  PetscFunctionBegin;
  PetscCall(TSSetUp(ts));
  PetscCall(TSGetTimeStep(ts, &h));
  PetscCall(factor_first_matrix(ts, context, h));
  PetscCall(solver_with_matrix(ts, &ksp));
  if (!ksp) PetscFunctionReturn(0);
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(make_pivots_relative(pc, true));
  PetscCall(KSPSetUpOnBlocks(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode check_first_matrix(TS ts, TSContext& context) {
  KSP ksp;
  PetscFunctionBegin;
  PetscCall(solver_with_matrix(ts, &ksp));
  PetscCall(context.model->check_solver(ksp));
  PetscFunctionReturn(0);
}

namespace {

/// Linear models: the factorisation is reused, so LU pays at any size; by MUMPS, which pivots (algebraic equations leave
/// zeros on the diagonal). Any other solver of the user's is to solve to ten digits: no Newton iteration mends its error; so is
/// GMRES under -snes_mf, which has no matrix to factor.
PetscErrorCode set_defaults_of_linear_model(TS ts) {
  KSP ksp;
  PC pc;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts, &ksp, &pc));
  PetscCall(KSPSetTolerances(ksp, 1e-10, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  bool matrix_free = false;
  PetscCall(is_on("-snes_mf", &matrix_free));
  if (matrix_free) {
    PetscCall(KSPSetType(ksp, KSPGMRES));
    PetscCall(PCSetType(pc, PCNONE));
    PetscFunctionReturn(0);
  }
  if (value_of("-pc_type", PCLU) != PCLU || (is_given("-ksp_type") && !is_given("-pc_type"))) PetscFunctionReturn(0);
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscFunctionReturn(0);
}

// Directions by absolute curvatures lead through all folds of a long step. In large lattices these are too many: there an attempt that
// is given up early costs less (a shell of 40,962 particles, 0.1 s in steps of 0.02 s at most: 122, 157 and more than 200 s with up to 25, 50 and
// 150 iterations).
PetscErrorCode allow_many_iterations(TS ts, const Tangent& tangent) {
  constexpr PetscInt MOST = 150, SMALL = 30000;
  SNES snes;
  PetscFunctionBegin;
  if (tangent.unknowns() > SMALL) PetscFunctionReturn(0);
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESSetTolerances(snes, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, MOST, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

/// Particle systems: the condensed solve wherever the user left KSP and PC open; nothing under -snes_mf, which has no
/// matrix to take it from.
PetscErrorCode set_condensed_defaults(TS ts, Model& model, NewtonPolicy* newton, Curvature curvature) {
  KSP ksp;
  PC pc;
  bool matrix_free = false, flexible = false, adaptive = false;
  PetscFunctionBegin;
  PetscCall(is_on("-snes_mf", &matrix_free));
  if (matrix_free || value_of("-pc_type", "condensed") != "condensed") PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, &ksp, &pc));
  PetscCall(PCSetType(pc, "condensed"));
  CondensedDemand demand;
  demand.direction = newton->settings().directions;
  demand.curvature = curvature;
  PetscCall(condensed_set_tangent(pc, model.tangent(), demand));
  DirectChoice choice;
  if (!is_given("-condensed_pc_type") && !is_given("-condensed_ksp_type")) PetscCall(choose_direct(*model.tangent(), &choice));
  if (demand.direction && curvature == Curvature::automatic) PetscCall(allow_many_iterations(ts, *model.tangent()));
  PetscCall(is_on("-snes_mf_operator", &flexible));
  PetscCall(is_on("-snes_ksp_ew", &adaptive));
  PetscCall(KSPSetType(ksp, flexible ? KSPFGMRES : KSPPREONLY));
  PetscCall(KSPSetTolerances(ksp, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  // nor is a direct solve better than its iterations for what the symmetric S leaves out
  if (!(choice.direct && model.tangent()->exact_symmetric()) && !is_given("-ksp_rtol") && !adaptive) newton->loosen_linear_solves();
  PetscFunctionReturn(0);
}

/// -pc_type fieldsplit of particles: the splits position and velocity, S = sigma M - D - K/sigma in the place of the second (M is diagonal, so that
/// PETSc's selfp gives S itself) and a flexible method around them, unless the user names other ones. Fields are numbered 0 to 2d - 1.
PetscErrorCode set_split_defaults(TS ts, const Model& model) {
  KSP ksp;
  PC pc;
  const PetscInt d = model.dim(), fields[] = {0, 1, 2, 3, 4, 5};
  std::string other_splits;
  PetscFunctionBegin;
  if (value_of("-pc_type", "") != PCFIELDSPLIT) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, &ksp, &pc));
  PetscCall(PCSetType(pc, PCFIELDSPLIT));
  PetscCall(PCFieldSplitSetDMSplits(pc, PETSC_FALSE));  // the DM that TS makes knows no fields, and PETSc crashes on that
  if (is_given("-pc_fieldsplit_block_size")) PetscFunctionReturn(0);
  PetscCall(PCFieldSplitSetBlockSize(pc, Layout{d}.block()));
  PetscCall(KSPSetType(ksp, KSPFGMRES));
  PetscCall(first_on({"-pc_fieldsplit_default", "-pc_fieldsplit_detect_saddle_point", "-pc_fieldsplit_detect_coupling"}, &other_splits));
  if (!other_splits.empty() || is_given("-pc_fieldsplit_0_fields")) PetscFunctionReturn(0);
  PetscCall(PCFieldSplitSetType(pc, PC_COMPOSITE_SCHUR));
  PetscCall(PCFieldSplitSetSchurPre(pc, PC_FIELDSPLIT_SCHUR_PRE_SELFP, nullptr));
  PetscCall(PCFieldSplitSetFields(pc, "position", d, fields, fields));
  PetscCall(PCFieldSplitSetFields(pc, "velocity", d, fields + d, fields + d));
  PetscCall(set_unless_given("-fieldsplit_position_ksp_type", KSPPREONLY));
  PetscCall(set_unless_given("-fieldsplit_position_pc_type", PCJACOBI));
  PetscFunctionReturn(0);
}

/// Direct solves for small systems, where the user left both KSP and PC open and asked for no matrix-free Newton.
PetscErrorCode set_direct_or_gmres(TS ts, PetscInt unknowns) {
  constexpr PetscInt SMALL = 12000;  // below, a sparse LU costs less than the Krylov iterations it saves
  std::string matrix_free;
  PetscFunctionBegin;
  PetscCall(first_on({"-snes_mf", "-snes_mf_operator"}, &matrix_free));
  if (is_given("-ksp_type") || is_given("-pc_type") || !matrix_free.empty() || unknowns > SMALL) PetscFunctionReturn(0);
  KSP ksp;
  PC pc;
  PetscCall(linear_solver_of(ts, &ksp, &pc));
  Mat operator_ = nullptr, matrix = nullptr;
  PetscCall(TSGetIJacobian(ts, &operator_, &matrix, nullptr, nullptr));
  if (operator_ == matrix) {
    PetscCall(KSPSetType(ksp, KSPPREONLY));
  } else {  // the matrix lacks what couples all particles: its factors are a preconditioner
    PetscCall(KSPSetType(ksp, KSPGMRES));
    PetscCall(KSPSetTolerances(ksp, 1e-10, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  }
  PetscCall(PCSetType(pc, PCLU));
  const PetscMPIInt size = size_of(PetscObjectComm(reinterpret_cast<PetscObject>(ts)));
  if (size > 1 || unknowns > 2000) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscFunctionReturn(0);
}

}  // namespace

// The condensed solve reads no entry of the full Jacobian, whose assembly takes 8 to 42 % of a step (triangular nets of 16 to 6,400 particles) and
// 23 % of that of a folding shell.
PetscErrorCode needs_matrix(Model& model, bool* yes) {
  int chosen = 0;
  std::string differences;
  PetscFunctionBegin;
  const std::string pc = value_of("-pc_type", "condensed");
  PetscCall(read_section(model.comm(), "Linear solver", [&](Section& o) {
    o.choice(
        "-bs_operator",
        "how implicit types represent the Jacobian of a particle system: as an assembled matrix, as a matrix-free shell, or auto: assembled where a "
        "solver or an option needs its entries, which -pc_type condensed does not",
        {"auto", "assembled", "shell"}, chosen);
  }));
  PetscCall(first_on({"-snes_fd", "-snes_fd_color"}, &differences));
  *yes = !differences.empty() || !model.tangent() || chosen == 1 || (pc != "condensed" && pc != PCNONE);
  for (const char* reader : {"-mat_type", "-mat_view", "-ksp_view_mat", "-ksp_view_pmat", "-snes_test_jacobian", "-snes_compare_explicit"})
    *yes = *yes || is_given(reader);
  for (const char* transposes : {SNESNEWTONTR, SNESNEWTONTRDC, SNESVINEWTONSSLS})  // the shell does it where the tangent is symmetric
    *yes = *yes || (chosen == 0 && value_of("-snes_type") == transposes && !model.tangent()->exact_symmetric());
  PetscFunctionReturn(0);
}

PetscErrorCode solver_tallies(TS ts, std::vector<Tally>* out) {
  PC pc;
  bool condensed = false;
  CondensedCounts counts;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_counts(pc, &condensed, &counts));
  if (!condensed) PetscFunctionReturn(0);
  out->push_back({"condensed_refreshed", "", counts.refreshed});
  out->push_back({"indefinite", "tangent{ was|s were} not positive definite", counts.indefinite});
  out->push_back({"definite", "Newton direction{ was|s were} taken from the definite part of the tangent", counts.definite});
  out->push_back({"unfinished", "Newton direction{ was|s were} taken before the linear solver had converged", counts.unfinished});
  out->push_back({"exhausted", "linear solve{s} failed because {its|their} iterations ran out", counts.exhausted});
  out->push_back({"broken_down", "linear solve{s} broke down for another reason than an indefinite tangent", counts.broken});
  out->push_back({"factored", "time{s} Cholesky factors took the place of iterations, which took more work (-condensed_pc_type bicc keeps to these)",
                  counts.factored});
  out->push_back({"factor_shifts", "incomplete factorisation{ was|s were} repeated with a larger diagonal", counts.shifts});
  PetscFunctionReturn(0);
}

PetscErrorCode set_linear_defaults(TS ts, Model& model, NewtonPolicy* newton) {
  PetscInt unknowns = 0;
  int curvature = 0;
  std::string differences;
  PetscFunctionBegin;
  PetscCall(first_on({"-snes_fd", "-snes_fd_color"}, &differences));
  PetscCall(read_section(model.comm(), "Newton's tangent", [&](Section& o) {
    o.choice("-bs_tangent",
             "tangent that determines Newton's directions with the line search energy: exact, definite (without the negative transverse stiffness of "
             "compressed springs), or auto (exact as long as it is positive definite, then by the absolute values of its curvatures; "
             "-snes_max_it is then 150, in lattices of more than 30,000 unknown velocities 50)",
             {"auto", "exact", "definite"}, curvature);
  }));
  PetscCall(VecGetSize(model.initial_state(), &unknowns));
  PetscCall(refuse_impossible_solvers(model.comm()));
  for (const char* prefix : {"", "condensed_"}) PetscCall(split_serial_factors(model.comm(), prefix));
  if (model.tangent()) PetscCall(set_split_defaults(ts, model));
  if (model.linear()) PetscCall(set_defaults_of_linear_model(ts));
  else if (model.tangent() && differences.empty()) PetscCall(set_condensed_defaults(ts, model, newton, static_cast<Curvature>(curvature)));
  else PetscCall(set_direct_or_gmres(ts, unknowns));
  PetscFunctionReturn(0);
}

}  // namespace bs
