#include "model/particles/condensed/particle_tangent.hpp"
#include <algorithm>
#include "base/memory.hpp"
#include "model/particles/events.hpp"

namespace bs {
namespace {

PetscErrorCode shell_multiply(Mat J, Vec z, Vec y) {
  ParticleTangent* self = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(J, &self));
  PetscCall(self->multiply(z, y));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode ParticleTangent::create(const Network& net, const Physics& physics, RowPattern& pattern, Vec layout, bool coupled) {
  PetscFunctionBegin;
  net_ = &net;
  physics_ = &physics;
  pattern_ = &pattern;
  layout_ = layout;
  coupled_ = coupled;
  const auto some = [](const std::vector<double>& values) {
    return std::any_of(values.begin(), values.end(), [](double c) { return c != 0; });
  };
  int damped = some(net.links.damping) || some(net.anchors.damping);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &damped, 1, MPI_INT, MPI_MAX, net.comm));
  damped_ = damped != 0;
  axial_damping_ = damped_ && net.damping_law == DampingLaw::axial;
  PetscCall(state_.create(net, layout));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleTangent::linearise(double t, Vec y, double sigma, Form form) {
  PetscFunctionBegin;
  t_ = t;
  sigma_ = sigma;
  form_ = form;
  PetscCall(state_.gather(y));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleTangent::create_shell(Mat* J) {
  PetscInt local = 0;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(layout_, &local));
  PetscCall(MatCreateShell(net_->comm, local, local, PETSC_DETERMINE, PETSC_DETERMINE, this, J));
  PetscCall(MatSetBlockSize(*J, 2 * net_->dim));
  PetscCall(MatSetVecType(*J, VECSTANDARD));
  PetscCall(MatShellSetOperation(*J, MATOP_MULT, reinterpret_cast<void (*)()>(shell_multiply)));
  PetscFunctionReturn(0);
}

// J z: scale M (sigma z_x - z_v) and scale (sigma M z_v - D z_v - K z_x); scale = 1 (momentum form), M^-1 (velocity form)
PetscErrorCode ParticleTangent::multiply(Vec z, Vec y) {
  const PetscInt d = net_->dim, bs = 2 * d;
  const PetscScalar* az = nullptr;
  PetscScalar* ay = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(particle_events().tangent, z, y, nullptr, nullptr));
  if (!direction_.created()) PetscCall(direction_.create(*net_, layout_));
  force_.resize(static_cast<std::size_t>(net_->n * d));
  PetscCall(direction_.gather_direction(z));
  physics_->multiply_tangent(t_, state_, direction_, force_.data());
  PetscCall(VecGetArrayRead(z, &az));
  PetscCall(VecGetArrayWrite(y, &ay));
  for (PetscInt i = 0; i < net_->n; ++i) {
    const double m = net_->mass[i], scale = form_ == Form::momentum ? 1.0 : 1.0 / m;
    for (PetscInt c = 0; c < d; ++c) {
      const PetscInt x = i * bs + c, v = x + d;
      ay[x] = scale * m * (sigma_ * az[x] - az[v]);
      ay[v] = scale * (sigma_ * m * az[v] - force_[i * d + c]);
    }
  }
  PetscCall(VecRestoreArrayWrite(y, &ay));
  PetscCall(VecRestoreArrayRead(z, &az));
  PetscCall(PetscLogEventEnd(particle_events().tangent, z, y, nullptr, nullptr));
  PetscFunctionReturn(0);
}

// b = r_v + (sigma M - D) a
PetscErrorCode ParticleTangent::condense(Vec r, Vec b) {
  const PetscInt d = net_->dim, bs = 2 * d;
  const PetscScalar* ar = nullptr;
  PetscScalar* ab = nullptr;
  PetscFunctionBegin;
  std::vector<double>& damping = force_;
  damping.assign(static_cast<std::size_t>(net_->n * d), 0.0);
  std::vector<double> a(damping.size());
  PetscCall(VecGetArrayRead(r, &ar));
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt c = 0; c < d; ++c) a[i * d + c] = ar[i * bs + c] / (form_ == Form::momentum ? net_->mass[i] : 1.0);
  if (damped_) {
    VecHandle shift;
    PetscScalar* as = nullptr;
    PetscCall(VecDuplicate(r, shift.out()));
    PetscCall(VecZeroEntries(shift));
    PetscCall(VecGetArray(shift, &as));
    for (PetscInt i = 0; i < net_->n; ++i) std::copy_n(a.begin() + i * d, d, as + i * bs + d);
    PetscCall(VecRestoreArray(shift, &as));
    if (!direction_.created()) PetscCall(direction_.create(*net_, layout_));
    PetscCall(direction_.gather_direction(shift));
    physics_->multiply_tangent(t_, state_, direction_, damping.data());
  } else {
    physics_->multiply_law_damping(t_, state_, a.data(), damping.data());
  }
  PetscCall(VecGetArrayWrite(b, &ab));
  for (PetscInt i = 0; i < net_->n; ++i) {
    const double m = net_->mass[i], scale = form_ == Form::momentum ? 1.0 : m;
    for (PetscInt c = 0; c < d; ++c) ab[i * d + c] = scale * ar[i * bs + d + c] + sigma_ * m * a[i * d + c] - damping[i * d + c];
  }
  PetscCall(VecRestoreArrayWrite(b, &ab));
  PetscCall(VecRestoreArrayRead(r, &ar));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleTangent::expand(Vec r, Vec w, Vec z) {
  const PetscInt d = net_->dim, bs = 2 * d;
  const PetscScalar *ar = nullptr, *aw = nullptr;
  PetscScalar* az = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(r, &ar));
  PetscCall(VecGetArrayRead(w, &aw));
  PetscCall(VecGetArrayWrite(z, &az));
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt c = 0; c < d; ++c) {
      const double a = ar[i * bs + c] / (form_ == Form::momentum ? net_->mass[i] : 1.0);
      az[i * bs + c] = aw[i * d + c] / sigma_;
      az[i * bs + d + c] = aw[i * d + c] - a;
    }
  PetscCall(VecRestoreArrayWrite(z, &az));
  PetscCall(VecRestoreArrayRead(w, &aw));
  PetscCall(VecRestoreArrayRead(r, &ar));
  PetscFunctionReturn(0);
}

// S w = sigma M w - (D w + K w/sigma)
PetscErrorCode ParticleTangent::multiply_condensed(Vec w, Vec y) {
  const PetscInt d = net_->dim, bs = 2 * d;
  const PetscScalar* aw = nullptr;
  PetscScalar *az = nullptr, *ay = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(particle_events().tangent, w, y, nullptr, nullptr));
  if (!direction_.created()) PetscCall(direction_.create(*net_, layout_));
  if (!both_) PetscCall(VecDuplicate(layout_, both_.out()));
  force_.resize(static_cast<std::size_t>(net_->n * d));
  PetscCall(VecGetArrayRead(w, &aw));
  PetscCall(VecGetArrayWrite(both_, &az));
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt c = 0; c < d; ++c) {
      az[i * bs + c] = aw[i * d + c] / sigma_;
      az[i * bs + d + c] = aw[i * d + c];
    }
  PetscCall(VecRestoreArrayWrite(both_, &az));
  PetscCall(direction_.gather_direction(both_));
  physics_->multiply_tangent(t_, state_, direction_, force_.data());
  PetscCall(VecGetArrayWrite(y, &ay));
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt c = 0; c < d; ++c) ay[i * d + c] = sigma_ * net_->mass[i] * aw[i * d + c] - force_[i * d + c];
  PetscCall(VecRestoreArrayWrite(y, &ay));
  PetscCall(VecRestoreArrayRead(w, &aw));
  PetscCall(PetscLogEventEnd(particle_events().tangent, w, y, nullptr, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleTangent::create(CondensedStorage storage, Mat* S) {
  PetscFunctionBegin;
  if (storage == CondensedStorage::springs) {
    matrices_.push_back(std::make_unique<SpringMatrix>());
    PetscCall(matrices_.back()->create(*net_));
    PetscCall(matrices_.back()->create_shell(S));
    PetscFunctionReturn(0);
  }
  if (!pattern_->created()) pattern_->create(*net_);
  PetscCall(reserve_memory(net_->comm, {"the condensed matrix of " + net_->source, block_matrix_bytes(*net_, *pattern_, storage),
                                        "give -condensed_mat_type springs, which takes less"}));
  PetscCall(create_block_matrix(*net_, *pattern_, storage, S));
  PetscCall(MatSetOption(*S, MAT_SYMMETRIC, PETSC_TRUE));
  if (storage == CondensedStorage::aij) PetscCall(set_rigid_modes(*S));
  PetscFunctionReturn(0);
}

/// Translations and rotations of the state linearised at, which springs alone do not resist.
PetscErrorCode ParticleTangent::set_rigid_modes(Mat S) const {
  const PetscInt d = net_->dim;
  PetscScalar* a = nullptr;
  VecHandle points;
  MatNullSpace modes = nullptr;
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(S, points.out(), nullptr));
  PetscCall(VecSetBlockSize(points, d));
  PetscCall(VecGetArrayWrite(points, &a));
  for (PetscInt i = 0; i < net_->n; ++i) std::copy_n(state_.at(i), d, a + i * d);
  PetscCall(VecRestoreArrayWrite(points, &a));
  PetscCall(MatNullSpaceCreateRigidBody(points, &modes));
  PetscCall(MatSetNearNullSpace(S, modes));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleTangent::assemble(bool positive, Mat S) {
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(particle_events().condense, S, nullptr, nullptr, nullptr));
  if (SpringMatrix* springs = SpringMatrix::from(S)) {
    physics_->condense_springs(t_, state_, sigma_, positive, springs);
    PetscCall(MatAssemblyBegin(S, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(S, MAT_FINAL_ASSEMBLY));
  } else {
    BlockRowWriter writer(*net_, *pattern_);
    PetscCall(writer.begin(S));
    PetscCall(physics_->condense_rows(t_, state_, sigma_, positive, &writer));
    PetscCall(writer.end());
  }
  PetscCall(PetscLogEventEnd(particle_events().condense, S, nullptr, nullptr, nullptr));
  PetscFunctionReturn(0);
}

}  // namespace bs
