#include "systems/first_order.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/vec_array.hpp"

namespace bs {

FirstOrder::FirstOrder(std::unique_ptr<Mechanics> mechanics) : own_(std::move(mechanics)), tangent_(own_->linearisation()) {}

// Momentum form F_x = M (x' - v), F_v = M v' - f; velocity form: both divided by M.
PetscErrorCode FirstOrder::residual(double t, Vec y, Vec ydot, Form form, Vec F) {
  const Layout at = own_->layout();
  const double *force = nullptr, *masses = own_->masses().data();
  PetscFunctionBegin;
  PetscCall(own_->force(t, y, &force));
  const ReadArray ay(y), ayd(ydot);
  const WriteArray aF(F);
  for (PetscInt i = 0; i < at.particles; ++i) {
    const double m = form == Form::momentum ? masses[i] : 1.0;
    const double scale = form == Form::momentum ? 1.0 : 1.0 / masses[i];
    for (PetscInt c = 0; c < at.dim; ++c) {
      const PetscInt x = at.x(i, c), v = at.v(i, c);
      aF[x] = m * (ayd[x] - ay[v]);
      aF[v] = m * ayd[v] - scale * force[i * at.dim + c];
    }
  }
  PetscFunctionReturn(0);
}

// G = (v, M^-1 f)
PetscErrorCode FirstOrder::rhs(double t, Vec y, Vec G) {
  const Layout at = own_->layout();
  const double *force = nullptr, *masses = own_->masses().data();
  PetscFunctionBegin;
  PetscCall(own_->force(t, y, &force));
  const ReadArray ay(y);
  const WriteArray aG(G);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      aG[at.x(i, c)] = ay[at.v(i, c)];
      aG[at.v(i, c)] = force[i * at.dim + c] / masses[i];
    }
  PetscFunctionReturn(0);
}

PetscErrorCode FirstOrder::jacobian(double t, Vec y, Vec, double sigma, Form form, Mat P) {
  PetscBool shell = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(tangent_.linearise(t, y, sigma, form));
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(P), MATSHELL, &shell));
  if (shell) {  // nothing to fill, but the preconditioner must know that J has changed
    PetscCall(assemble(P));
    PetscFunctionReturn(0);
  }
  PetscCall(own_->assemble_first_order(sigma, form == Form::momentum, P));
  if (tangent_.inertia() != 1) PetscCall(add_inertia(sigma, form, P));
  PetscFunctionReturn(0);
}

// (mu - sigma) M, or (mu - sigma), on the diagonal of the rows of v
PetscErrorCode FirstOrder::add_inertia(double sigma, Form form, Mat P) {
  const Layout at = own_->layout();
  const double* masses = own_->masses().data();
  PetscScalar* add = nullptr;
  PetscFunctionBegin;
  if (!diagonal_) PetscCall(VecDuplicate(initial_state(), diagonal_.out()));
  PetscCall(VecZeroEntries(diagonal_));
  PetscCall(VecGetArray(diagonal_, &add));
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) add[at.v(i, c)] = (tangent_.inertia() - 1) * sigma * (form == Form::momentum ? masses[i] : 1.0);
  PetscCall(VecRestoreArray(diagonal_, &add));
  PetscCall(MatDiagonalSet(P, diagonal_, ADD_VALUES));
  PetscFunctionReturn(0);
}

PetscErrorCode FirstOrder::create_matrix(Mat* P) {
  PetscFunctionBegin;
  PetscCall(own_->create_first_order(P));
  PetscCall(attach_tangent(*P, &tangent_));
  PetscFunctionReturn(0);
}

PetscErrorCode FirstOrder::create_shell(Mat* P) {
  PetscFunctionBegin;
  PetscCall(tangent_.create_shell(P));
  PetscCall(attach_tangent(*P, &tangent_));
  PetscFunctionReturn(0);
}

PetscErrorCode FirstOrder::residual_norms(Vec F, ResidualNorms* norms) {
  const Layout at = own_->layout();
  *norms = {0, 0};
  PetscFunctionBegin;
  const ReadArray aF(F);
  for (PetscInt i = 0; i < at.particles; ++i) {
    for (PetscInt k = at.x(i); k < at.x(i) + at.dim; ++k) (*norms)[0] += aF[k] * aF[k];
    for (PetscInt k = at.v(i); k < at.v(i) + at.dim; ++k) (*norms)[1] += aF[k] * aF[k];
  }
  PetscCall(sum_over_ranks(comm(), norms->data(), 2));
  for (double& norm : *norms) norm = std::sqrt(norm);
  PetscFunctionReturn(0);
}

// A particle left with the forces F_v of the momentum form would be sigma m dv = F_v away from its velocity if no spring held
// it, and F_x = m dv; what rounding errors of its own forces make of that is not counted.
PetscErrorCode FirstOrder::velocity_errors(Vec y, Vec F, double sigma, Form form, double* worst, double* fastest) {
  constexpr double NEAR = 100;
  const Layout at = own_->layout();
  const double* masses = own_->masses().data();
  double high[2] = {0, 0};
  PetscFunctionBegin;
  const ReadArray ay(y), aF(F);
  for (PetscInt i = 0; i < at.particles; ++i) {
    const double mass = form == Form::momentum ? masses[i] : 1.0;
    double error = 0, v = 0;
    for (PetscInt c = 0; c < at.dim; ++c) {
      v = std::max(v, std::abs(ay[at.v(i, c)]));
      error = std::max({error, std::abs(aF[at.x(i, c)]) / mass, std::abs(aF[at.v(i, c)]) / (sigma * mass)});
    }
    high[0] = std::max(high[0], error - NEAR * rounding_[static_cast<std::size_t>(i)]);
    high[1] = std::max(high[1], v);
  }
  PetscCall(max_over_ranks(comm(), high, 2));
  *worst = high[0];
  *fastest = high[1];
  PetscFunctionReturn(0);
}

// Rounding of the forces, of M v' and of M (x' - v), with the derivatives as sigma times the state.
PetscErrorCode FirstOrder::residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) {
  const Layout at = own_->layout();
  const double* masses = own_->masses().data();
  *floor = {0, 0};
  PetscFunctionBegin;
  std::vector<double> size(static_cast<std::size_t>(at.particles * at.dim));
  PetscCall(own_->force_magnitudes(t, y, sigma, size.data()));
  rounding_.assign(static_cast<std::size_t>(at.particles), 0.0);
  const ReadArray ay(y);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      const double x = std::abs(ay[at.x(i, c)]), v = std::abs(ay[at.v(i, c)]), force = size[static_cast<std::size_t>(i * at.dim + c)];
      const double scale = form == Form::momentum ? 1.0 : 1.0 / masses[i];
      const double momentum = scale * (force + masses[i] * sigma * v);
      const double kinematic = scale * masses[i] * (sigma * x + v);
      double& rounding = rounding_[static_cast<std::size_t>(i)];
      rounding = std::max(rounding, 2 * PETSC_MACHINE_EPSILON * std::max(momentum / sigma, kinematic) / (scale * masses[i]));
      (*floor)[0] += kinematic * kinematic;
      (*floor)[1] += momentum * momentum;
    }
  PetscCall(sum_over_ranks(comm(), floor->data(), 2));
  for (double& norm : *floor) norm = 2 * PETSC_MACHINE_EPSILON * std::sqrt(norm);
  PetscFunctionReturn(0);
}

}  // namespace bs
