#include "systems/linear/linear_model.hpp"
#include <petsc/private/petscimpl.h>
#include <cmath>
#include "base/error.hpp"
#include "base/memory.hpp"

namespace bs {

// B u(t) lives in Bu_ until the next call
PetscErrorCode LinearModel::set_sources(double t) {
  PetscInt first, last;
  PetscScalar* au;
  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(u_, &first, &last));
  PetscCall(VecGetArrayWrite(u_, &au));
  for (PetscInt k = first; k < last; ++k) au[k - first] = sources_.at(static_cast<std::size_t>(k), t);
  PetscCall(VecRestoreArrayWrite(u_, &au));
  PetscCall(MatMult(system_.B, u_, Bu_));
  PetscFunctionReturn(0);
}

/// F += scale B u(t)
PetscErrorCode LinearModel::add_sources(double t, double scale, Vec F) {
  PetscFunctionBegin;
  if (!system_.B) PetscFunctionReturn(0);
  PetscCall(set_sources(t));
  PetscCall(VecAXPY(F, scale, Bu_));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::apply_inverse_C(Vec x) {
  PetscFunctionBegin;
  if (diagonal_) {
    PetscCall(VecPointwiseDivide(x, x, diagonal_C_));
  } else {
    PetscCall(VecCopy(x, work_));
    PetscCall(KSPSolve(C_solver_, work_, x));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::residual(double t, Vec y, Vec ydot, Form form, Vec F) {
  PetscFunctionBegin;
  PetscCall(MatMult(system_.G, y, F));
  PetscCall(add_sources(t, -1, F));
  if (form == Form::momentum) {
    PetscCall(MatMultAdd(system_.C, ydot, F, F));
  } else {
    PetscCall(apply_inverse_C(F));
    PetscCall(VecAXPY(F, 1, ydot));
  }
  PetscFunctionReturn(0);
}

// x' = C^-1 (B u - G x)
PetscErrorCode LinearModel::rhs(double t, Vec y, Vec G) {
  PetscFunctionBegin;
  PetscCall(MatMult(system_.G, y, G));
  PetscCall(VecScale(G, -1));
  PetscCall(add_sources(t, 1, G));
  PetscCall(apply_inverse_C(G));
  PetscFunctionReturn(0);
}

// The state of an unchanged matrix stays what it was, and so does its factorisation.
PetscErrorCode LinearModel::jacobian(double, Vec, Vec, double sigma, Form form, Mat P) {
  PetscObjectId id;
  PetscObjectState state;
  PetscFunctionBegin;
  PetscCall(PetscObjectGetId(reinterpret_cast<PetscObject>(P), &id));
  PetscCall(PetscObjectStateGet(reinterpret_cast<PetscObject>(P), &state));
  Filling* mine = nullptr;
  for (Filling& filling : filled_)
    if (filling.id == id) mine = &filling;
  if (mine && mine->state == state && std::abs(sigma - mine->sigma) <= 1e-12 * mine->sigma) PetscFunctionReturn(0);
  PetscCall(MatZeroEntries(P));
  PetscCall(MatAXPY(P, 1, system_.G, SUBSET_NONZERO_PATTERN));
  if (form == Form::momentum) {
    PetscCall(MatAXPY(P, sigma, system_.C, SUBSET_NONZERO_PATTERN));
  } else {
    PetscCall(VecCopy(diagonal_C_, work_));
    PetscCall(VecReciprocal(work_));
    PetscCall(MatDiagonalScale(P, work_, nullptr));
    PetscCall(MatShift(P, sigma));
  }
  PetscCall(PetscObjectStateGet(reinterpret_cast<PetscObject>(P), &state));
  if (mine) *mine = {id, state, sigma};
  else filled_.push_back({id, state, sigma});
  ++fillings_;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::create_matrix(Mat* P) {
  PetscInt n, local;
  PetscFunctionBegin;
  MatInfo info;
  PetscCall(MatGetInfo(system_.G, MAT_LOCAL, &info));
  PetscCall(reserve_memory(comm_, {"the matrix of a step of " + system_.origin, info.nz_used * (sizeof(PetscScalar) + sizeof(PetscInt)), ""}));
  // the whole diagonal, so that incomplete factorisations find it
  MatHandle diagonal;
  PetscCall(MatGetSize(system_.G, &n, nullptr));
  PetscCall(MatGetLocalSize(system_.G, &local, nullptr));
  VecHandle ones;
  PetscCall(VecDuplicate(system_.x0, ones.out()));
  PetscCall(VecSet(ones, 1));
  PetscCall(MatCreateAIJ(comm_, local, local, n, n, 1, nullptr, 0, nullptr, diagonal.out()));
  PetscCall(MatDiagonalSet(diagonal, ones, INSERT_VALUES));
  PetscCall(MatDuplicate(system_.G, MAT_COPY_VALUES, P));
  PetscCall(MatAXPY(*P, 1, system_.C, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatAXPY(*P, 1, diagonal, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatZeroEntries(*P));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::create_operator(Mat P, Form, Mat* A) {
  PetscFunctionBegin;
  PetscCall(PetscObjectReference(reinterpret_cast<PetscObject>(P)));
  *A = P;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::residual_norms(Vec F, ResidualNorms* norms) {
  PetscFunctionBegin;
  *norms = {0, 0};
  PetscCall(VecNorm(F, NORM_2, &(*norms)[0]));
  PetscFunctionReturn(0);
}

// Every product of a row is rounded to eps of its size.
PetscErrorCode LinearModel::residual_floor(double, Vec y, double sigma, Form, ResidualNorms* floor) {
  PetscReal size;
  PetscFunctionBegin;
  PetscCall(VecNorm(y, NORM_2, &size));
  *floor = {PETSC_MACHINE_EPSILON * (norm_G_ + sigma * norm_C_) * size, 0};
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::covers(double, double t_end) {
  PetscFunctionBegin;
  const std::string error = sources_.covers(start_, t_end);
  if (!error.empty()) PetscCall(fail(comm_, Exit::input, error));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::last_fault(std::string* text) {
  PetscFunctionBegin;
  text->clear();
  PetscFunctionReturn(0);
}

}  // namespace bs
