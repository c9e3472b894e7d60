// Which eigensolver, and its settings.
#include <algorithm>
#include <cmath>
#include "base/error.hpp"
#include "linalg/eigen/mode_solver.hpp"
#include "linalg/solver_options.hpp"

namespace bs {
namespace {

/// Without shift and invert: omega^2 relative to their size, those near zero relative to a millionth of the mean of A's sizes. Those that are
/// rounding need no more digits, nor can they have them beside many others whose own residuals stand against them: a ten-thousandth.
PetscErrorCode relative_error(EPS, PetscScalar value, PetscScalar, PetscReal residual, PetscReal* error, void* mean) {
  constexpr double ROUNDING = 1e-14, SOFT = 1e-6, NOTHING = 1e-4;
  const double size = *static_cast<const double*>(mean), found = std::abs(value);
  *error = residual / std::max(found, (found <= ROUNDING * size ? NOTHING : SOFT) * size);
  return 0;
}

}  // namespace

/// Vectors of a Davidson basis. Each is kept with its product, so that in large systems few go beyond the modes; multiple and unstable omega^2 take
/// more, and far more those inside the spectrum, which the preconditioner does not know.
PetscInt ModeSolver::basis_for(PetscInt modes) const {
  constexpr PetscInt FEW = 14, MANY = 46, ROOM = 1000000, FEW_INSIDE = 40, MANY_INSIDE = 110, ROOM_INSIDE = 20000000;
  const PetscInt n = form_.unknowns();
  const PetscInt beyond = request_.which == ModeRequest::target ? std::clamp<PetscInt>(ROOM_INSIDE / n, FEW_INSIDE, MANY_INSIDE)
                                                                : std::clamp<PetscInt>(ROOM / n, FEW, MANY);
  return std::min(n, modes + beyond);
}

/// Cholesky by MUMPS, whose pivots' signs are counted.
PetscErrorCode ModeSolver::set_sparse_factors(KSP ksp) const {
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(count_mumps_pivots(pc));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::choose() {
  constexpr PetscInt DENSE = 400, DENSE_MANY = 3000, DIRECT = 20000, DIRECT_INSIDE = 100000, DIRECT_FLAT = 400000;
  const PetscInt n = form_.unknowns();
  PetscFunctionBegin;
  // a Davidson method needs room for a basis of several times the modes
  const PetscInt least = request_.which == ModeRequest::target ? basis_for(request_.count) : request_.count;
  if (request_.method == ModeRequest::iterative && n <= std::max<PetscInt>(60, 4 * least)) request_.method = ModeRequest::dense;
  if (request_.method != ModeRequest::automatic) PetscFunctionReturn(0);
  const bool flat = form_.linearised().dim() < 3, pairs = form_.linearised().pairwise();
  if (n <= DENSE || (n <= DENSE_MANY && request_.count > n / 4)) request_.method = ModeRequest::dense;
  else {
    const PetscInt most = flat || !pairs ? DIRECT_FLAT : request_.which == ModeRequest::target ? DIRECT_INSIDE : DIRECT;
    request_.method = n <= most ? ModeRequest::direct : ModeRequest::iterative;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::create_dense() {
  PetscFunctionBegin;
  PetscCall(form_.assemble(A_.out()));
  PetscCall(EPSSetType(eps_, EPSLAPACK));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::create_direct() {
  constexpr double INVERTED = 1e-12;
  ST st;
  KSP ksp;
  PetscFunctionBegin;
  PetscCall(form_.assemble(A_.out()));
  PetscCall(EPSSetType(eps_, EPSKRYLOVSCHUR));
  if (request_.which == ModeRequest::largest) {
    PetscCall(EPSSetWhichEigenpairs(eps_, EPS_LARGEST_REAL));
    PetscFunctionReturn(0);
  }
  // relative to 1/(omega^2 - shift): what is left of far modes is this part of their omega^2
  PetscCall(EPSSetTolerances(eps_, INVERTED, PETSC_DEFAULT));
  PetscCall(EPSGetST(eps_, &st));
  PetscCall(STSetType(st, STSINVERT));
  PetscCall(STGetKSP(st, &ksp));
  PetscCall(EPSSetOperators(eps_, A_, nullptr));
  PetscCall(KSPSetOperators(ksp, A_, A_));  // MUMPS is set up for a matrix of this type; STSetUp gives the shifted one
  PetscCall(set_sparse_factors(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::create_iterative() {
  constexpr double SHIFT = 1e-6;
  ST st;
  KSP ksp;
  PC pc;
  PetscFunctionBegin;
  PetscCall(form_.create_operator(A_.out()));
  if (request_.which == ModeRequest::largest) {
    PetscCall(EPSSetType(eps_, EPSKRYLOVSCHUR));
    PetscCall(EPSSetWhichEigenpairs(eps_, EPS_LARGEST_REAL));
    PetscFunctionReturn(0);
  }
  PetscCall(EPSSetType(eps_, EPSGD));
  PetscCall(EPSSetWhichEigenpairs(eps_, request_.which == ModeRequest::target ? EPS_TARGET_MAGNITUDE : EPS_SMALLEST_REAL));
  if (request_.which == ModeRequest::target) PetscCall(EPSSetTarget(eps_, request_.near));
  PetscCall(EPSSetDimensions(eps_, request_.count, basis_for(request_.count), PETSC_DEFAULT));
  PetscCall(EPSGetST(eps_, &st));
  PetscCall(STSetType(st, STPRECOND));
  PetscCall(STGetKSP(st, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(form_.create_preconditioner(SHIFT * size_, pc));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::create_solver() {
  PetscFunctionBegin;
  PetscCall(EPSCreate(form_.comm(), eps_.out()));
  PetscCall(request_.method == ModeRequest::dense ? create_dense() : request_.method == ModeRequest::direct ? create_direct() : create_iterative());
  PetscCall(EPSSetOperators(eps_, A_, nullptr));
  PetscCall(EPSSetProblemType(eps_, EPS_HEP));
  const bool inverts = request_.method == ModeRequest::direct && request_.which != ModeRequest::largest;
  if (request_.method != ModeRequest::dense && !inverts) PetscCall(EPSSetConvergenceTestFunction(eps_, relative_error, &size_, nullptr));
  PetscCall(EPSSetFromOptions(eps_));
  PetscCall(EPSGetDimensions(eps_, nullptr, &basis_, &projected_));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::create(std::string* method) {
  EPSType type = nullptr;
  PetscFunctionBegin;
  PetscCall(choose());
  PetscCall(form_.create_vector(sizes_.out()));
  PetscCall(form_.sizes(sizes_));
  PetscCall(measure());
  PetscCall(create_solver());
  PetscCall(EPSGetType(eps_, &type));
  const char* const how[] = {"", " (dense)", " (shift and invert by MUMPS)", " (block factors and a coarse grid)"};
  *method = std::string(type) + how[request_.method];
  PetscFunctionReturn(0);
}

}  // namespace bs
