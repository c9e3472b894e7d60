#include "systems/particles/condensed/coarse_space.hpp"
#include <algorithm>
#include <cmath>
#include <string>
#include "systems/particles/condensed/coarse_matrix.hpp"
#include "systems/particles/events.hpp"
#include "systems/particles/supports.hpp"

namespace bs {

namespace {

constexpr double STIFF = 100;         // times the usual spring: a coarse motion must not strain it
constexpr PetscInt FINE = 60;         // unknowns of S a coarse one stands for
constexpr int BLENDS = 1;             // steps by which groups are made to overlap: a second one saves few iterations
constexpr PetscInt REDUNDANT = 2000;  // unknowns up to which every rank solves with E by itself
constexpr PetscInt DIRECT = 100000;   // and up to which E is factored

/// Collective. The geometric mean of the pairs' sizes.
PetscErrorCode usual_size(const SpringMatrix& S, double* usual) {
  double sum[2] = {0, 0};
  PetscFunctionBegin;
  for (std::size_t k = 0; k < S.pattern().pairs(); ++k) {
    const double size = size_of_pair(S.pair(k), S.dim());
    if (size > 0) sum[0] += std::log(size), sum[1] += 1;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sum, 2, MPI_DOUBLE, MPI_SUM, S.network().comm));
  *usual = sum[1] > 0 ? std::exp(sum[0] / sum[1]) : 0;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode CoarseSpace::create(SpringMatrix& S, PetscInt unknowns, const char* prefix) {
  const Network& net = S.network();
  const int width = rigid_width(net.dim);
  const PetscInt free = net.total - static_cast<PetscInt>(net.fixed_total);
  double usual = 0;
  MatHandle E;

  PetscFunctionBegin;
  active_ = false;
  unknowns_ = 0;
  if (net.supports && net.supports->rolls()) PetscFunctionReturn(0);  // E would take rollers for free
  // E would lack what R holds, and the correction be too large
  if (S.remainder().created() || unknowns == 0 || free == 0) PetscFunctionReturn(0);
  PetscInt particles = FINE * width / net.dim;
  if (unknowns > 0) particles = std::max(particles, (free * width + unknowns - 1) / unknowns);
  PetscCall(usual_size(S, &usual));
  groups_.create(S, STIFF * usual, particles, BLENDS);
  motions_.create(net.dim, S.points(), groups_);
  PetscCall(create_coarse_matrix(S, motions_, E.out()));
  PetscCall(MatGetSize(E, &unknowns_, nullptr));
  if (unknowns_ == 0) PetscFunctionReturn(0);
  PetscCall(MatCreateVecs(E, in_.out(), out_.out()));
  PetscCall(choose_solver(net.comm, prefix));  // anew: the number of groups may have changed
  if (!exact_) PetscCall(set_near_null_space(E));
  PetscCall(KSPSetOperators(solver_, E, E));
  PetscCall(KSPSetUp(solver_));
  PC pc;
  PCFailedReason failed;
  PetscCall(KSPGetPC(solver_, &pc));
  PetscCall(PCGetFailedReason(pc, &failed));
  active_ = failed == PC_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSpace::choose_solver(MPI_Comm comm, const char* prefix) {
  PetscMPIInt ranks;
  PC pc;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  PetscCall(KSPCreate(comm, solver_.out()));
  PetscCall(KSPSetOptionsPrefix(solver_, ((prefix ? prefix : "") + std::string("coarse_")).c_str()));
  PetscCall(KSPSetErrorIfNotConverged(solver_, PETSC_FALSE));
  PetscCall(KSPGetPC(solver_, &pc));
  PetscCall(KSPSetType(solver_, KSPPREONLY));
  if (unknowns_ <= DIRECT) {
    if (ranks > 1 && unknowns_ <= REDUNDANT) {
      PetscCall(PCSetType(pc, PCREDUNDANT));
    } else {
      PetscCall(PCSetType(pc, PCCHOLESKY));
      PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    }
  } else {
    PetscCall(PCSetType(pc, PCGAMG));
  }
  PetscCall(KSPSetFromOptions(solver_));
  PCType type;
  PetscCall(PCGetType(pc, &type));
  exact_ = std::string(type) == PCCHOLESKY || std::string(type) == PCLU || std::string(type) == PCREDUNDANT;
  PetscFunctionReturn(0);
}

/// What algebraic multigrid must represent: the rigid motions of all groups together.
PetscErrorCode CoarseSpace::set_near_null_space(Mat E) const {
  const int width = rigid_width(motions_.dim());
  MatNullSpace space = nullptr;
  std::vector<VecHandle> motions(static_cast<std::size_t>(width));
  std::vector<Vec> vectors;
  PetscFunctionBegin;
  for (int k = 0; k < width; ++k) {
    Vec v = nullptr;
    PetscScalar* a = nullptr;
    PetscCall(VecDuplicate(in_, motions[static_cast<std::size_t>(k)].out()));
    v = motions[static_cast<std::size_t>(k)];
    PetscCall(VecGetArrayWrite(v, &a));
    motions_.whole_motion(k, a);
    PetscCall(VecRestoreArrayWrite(v, &a));
    for (Vec before : vectors) {  // orthonormal, as MatNullSpaceCreate wants them
      PetscScalar product = 0;
      PetscCall(VecDot(v, before, &product));
      PetscCall(VecAXPY(v, -product, before));
    }
    PetscReal length = 0;
    PetscCall(VecNormalize(v, &length));
    if (length > 0) vectors.push_back(v);
  }
  PetscCall(MatNullSpaceCreate(PetscObjectComm(reinterpret_cast<PetscObject>(E)), PETSC_FALSE, static_cast<PetscInt>(vectors.size()), vectors.data(),
                               &space));
  PetscCall(MatSetNearNullSpace(E, space));
  PetscCall(MatNullSpaceDestroy(&space));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSpace::add(Vec r, Vec z, PetscReal* energy) {
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;

  PetscFunctionBegin;
  if (energy) *energy = 0;
  if (!active_) PetscFunctionReturn(0);
  PetscCall(PetscLogEventBegin(particle_events().coarse, r, z, nullptr, nullptr));
  PetscCall(VecGetArrayRead(r, &from));
  PetscCall(VecGetArrayWrite(in_, &to));
  motions_.restrict_to(from, to);
  PetscCall(VecRestoreArrayWrite(in_, &to));
  PetscCall(VecRestoreArrayRead(r, &from));
  PetscCall(KSPSolve(solver_, in_, out_));
  if (energy) {
    PetscScalar product = 0;
    PetscCall(VecDot(in_, out_, &product));
    *energy = PetscRealPart(product);
  }
  PetscCall(VecGetArrayRead(out_, &from));
  PetscCall(VecGetArray(z, &to));
  motions_.prolong(from, to);
  PetscCall(VecRestoreArray(z, &to));
  PetscCall(VecRestoreArrayRead(out_, &from));
  PetscCall(PetscLogEventEnd(particle_events().coarse, r, z, nullptr, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSpace::view(PetscViewer viewer) const {
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  PetscCall(PetscViewerASCIIPushTab(viewer));
  PetscCall(PetscViewerASCIIPrintf(viewer, "coarse space: rigid motions of groups of particles, %" PetscInt_FMT " unknowns, solved by\n", unknowns_));
  PetscCall(KSPView(solver_, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(0);
}

}  // namespace bs
