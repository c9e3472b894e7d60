#include "linalg/rigid_space.hpp"
#include <algorithm>

namespace bs {

namespace {

constexpr PetscInt FINE = 60, FINE_BENT = 15;  // unknowns of S a coarse one stands for; the same where S has a remainder
constexpr PetscInt MOST = 20000;               // coarse ones, on every rank
constexpr int BLENDS = 1;                      // steps by which groups are made to overlap: a second one saves few iterations

}  // namespace

PetscErrorCode RigidSpace::create(PairMatrix& S, PetscInt unknowns, const std::string& prefix) {
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(linear_events().coarse_set_up, nullptr, nullptr, nullptr, nullptr));
  PetscCall(make(S, unknowns, prefix));
  PetscCall(PetscLogEventEnd(linear_events().coarse_set_up, nullptr, nullptr, nullptr, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode RigidSpace::make(PairMatrix& S, PetscInt unknowns, const std::string& prefix) {
  const int width = rigid_width(S.dim());
  MatHandle E;

  PetscFunctionBegin;
  graph_ = &S.graph();
  const PetscInt free = graph_->free;
  active_ = false;
  if (unknowns == 0 || free == 0) PetscFunctionReturn(0);
  const PetscInt most = std::max<PetscInt>(1, (unknowns > 0 ? unknowns : MOST) / width);
  const PetscInt fine = S.remainder().created() ? FINE_BENT : FINE;
  const PetscInt size = std::max<PetscInt>(unknowns > 0 ? 1 : fine * width / S.dim(), free / most + 1);
  if (!grouped_) groups_.create(S, size, BLENDS);
  grouped_ = true;
  motions_.create(S.dim(), S.positions(), groups_);
  PetscCall(create_coarse_matrix(S, motions_, E.out()));
  PetscCall(MatGetSize(E, &unknowns_, nullptr));
  if (unknowns_ == 0) PetscFunctionReturn(0);
  PetscCall(MatCreateVecs(E, in_.out(), out_.out()));
  PetscCall(factor(E, prefix));
  PetscFunctionReturn(0);
}

// Every rank factors all of E by itself: MUMPS on several ranks does not repeat its last digits.
PetscErrorCode RigidSpace::factor(Mat E, const std::string& prefix) {
  PetscMPIInt ranks;
  PCFailedReason failed;
  PC own = nullptr;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(graph_->comm, &ranks));
  PetscCall(PCCreate(graph_->comm, factors_.out()));
  PetscCall(PCSetOptionsPrefix(factors_, (prefix + "coarse_").c_str()));
  PetscCall(PCSetOperators(factors_, E, E));
  own = factors_;
  if (ranks > 1) {
    KSP ksp;
    PetscCall(PCSetType(factors_, PCREDUNDANT));
    PetscCall(PCRedundantGetKSP(factors_, &ksp));
    PetscCall(KSPGetPC(ksp, &own));
  }
  PetscCall(PCSetType(own, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(own, MATSOLVERMUMPS));
  PetscCall(PCSetFromOptions(factors_));
  PetscCall(PCSetUp(factors_));
  PetscCall(PCGetFailedReason(factors_, &failed));
  active_ = failed == PC_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode RigidSpace::add(Vec r, Vec z) {
  const PetscScalar *from = nullptr, *coarse = nullptr;
  PetscScalar* to = nullptr;

  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  const bool holds = graph_->holds;
  const std::size_t size = static_cast<std::size_t>(graph_->n) * static_cast<std::size_t>(graph_->dim);
  PetscCall(PetscLogEventBegin(linear_events().coarse, r, z, nullptr, nullptr));
  PetscCall(VecGetArrayRead(r, &from));
  PetscCall(VecGetArrayWrite(in_, &to));
  if (holds) {
    free_.assign(from, from + size);
    graph_->clear_held(free_.data());
  }
  motions_.restrict_to(holds ? free_.data() : from, to);
  PetscCall(VecRestoreArrayWrite(in_, &to));
  PetscCall(VecRestoreArrayRead(r, &from));
  PetscCall(PCApply(factors_, in_, out_));
  PetscCall(VecGetArrayRead(out_, &coarse));
  PetscCall(VecGetArray(z, &to));
  if (holds) {
    moved_.assign(size, 0.0);
    motions_.prolong(coarse, moved_.data());
    graph_->clear_held(moved_.data());
    for (std::size_t k = 0; k < size; ++k) to[k] += moved_[k];
  } else {
    motions_.prolong(coarse, to);
  }
  PetscCall(VecRestoreArray(z, &to));
  PetscCall(VecRestoreArrayRead(out_, &coarse));
  // of a share, in each direction: force and moment, or velocity and spin, times the share, added
  PetscCall(PetscLogFlops(4.0 * rigid_width(graph_->dim) * static_cast<double>(motions_.shares().group.size())));
  PetscCall(PetscLogEventEnd(linear_events().coarse, r, z, nullptr, nullptr));
  PetscFunctionReturn(0);
}

}  // namespace bs
