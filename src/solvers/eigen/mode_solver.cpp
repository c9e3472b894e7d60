#include "solvers/eigen/mode_solver.hpp"
#include <algorithm>
#include <cmath>
#include "base/fault.hpp"
#include "solvers/eigen/rigid_motions.hpp"

namespace bs {
namespace {

constexpr double ZERO = 1e-13;  // omega^2 relative to what each component alone would have: below it is rounding

/// Modes found beyond those asked for: Krylov methods may meet the copies of a multiple omega^2 late.
constexpr PetscInt GUARD = 3;

/// Mean and maximum over all ranks of what `a` holds: log mean of the positive entries, largest size.
PetscErrorCode sizes(Vec a, double* mean, double* widest) {
  const PetscScalar* v = nullptr;
  PetscInt n = 0;
  double sums[2] = {0, 0};
  PetscReal most = 0;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(a, &n));
  PetscCall(VecGetArrayRead(a, &v));
  for (PetscInt k = 0; k < n; ++k)
    if (v[k] > 0) {
      sums[0] += std::log(v[k]);
      sums[1] += 1;
    }
  PetscCall(VecRestoreArrayRead(a, &v));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, PetscObjectComm(reinterpret_cast<PetscObject>(a))));
  PetscCall(VecNorm(a, NORM_INFINITY, &most));
  *mean = sums[1] > 0 ? std::exp(sums[0] / sums[1]) : 1.0;
  *widest = most;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode ModeSolver::measure() {
  PetscFunctionBegin;
  PetscCall(sizes(diagonal_, &size_, &widest_));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::judge(Mode* mode) {
  VecHandle force, each;
  PetscScalar value = 0, size = 0;
  PetscReal left = 0;
  PetscFunctionBegin;
  PetscCall(VecNormalize(mode->u, nullptr));
  PetscCall(VecDuplicate(mode->u, force.out()));
  PetscCall(VecDuplicate(mode->u, each.out()));
  PetscCall(form_.multiply(mode->u, force));
  PetscCall(VecDot(mode->u, force, &value));
  PetscCall(VecAXPY(force, -value, mode->u));
  PetscCall(VecNorm(force, NORM_2, &left));
  PetscCall(VecPointwiseMult(each, mode->u, diagonal_));
  PetscCall(VecAbs(each));
  PetscCall(VecCopy(mode->u, force));
  PetscCall(VecAbs(force));
  PetscCall(VecDot(each, force, &size));
  mode->omega_squared = value;
  mode->residual = left;
  mode->zero = std::abs(value) <= ZERO * size;
  PetscFunctionReturn(0);
}

void ModeSolver::sort() {
  std::sort(found_.begin(), found_.end(), [](const Mode& a, const Mode& b) { return a.omega_squared < b.omega_squared; });
}

/// How many that count were found.
PetscInt ModeSolver::wanted() const {
  PetscInt have = 0;
  for (const Mode& mode : found_) have += request_.keep_rigid || !mode.zero ? 1 : 0;
  return request_.count - have;
}

PetscErrorCode ModeSolver::negative_pivots(double shift, PetscInt* count) {
  KSPHandle ksp;
  PC pc;
  Mat factors = nullptr;
  MatHandle shifted;
  PetscInt zero = 0, positive = 0;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(A_, MAT_COPY_VALUES, shifted.out()));
  PetscCall(MatShift(shifted, -shift));
  PetscCall(MatSetOption(shifted, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(KSPCreate(form_.comm(), ksp.out()));
  PetscCall(KSPSetOperators(ksp, shifted, shifted));
  PetscCall(set_sparse_factors(ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCFactorGetMatrix(pc, &factors));
  PetscCall(MatGetInertia(factors, count, &zero, &positive));
  PetscFunctionReturn(0);
}

/// A shift below all omega^2, near the smallest.
PetscErrorCode ModeSolver::place_shift() {
  constexpr double NEAR = 1e-8, FARTHER = 16;
  ST st;
  PetscInt below = 1;
  double shift = 0;
  PetscFunctionBegin;
  if (request_.which == ModeRequest::target) {
    shift = request_.near;
    PetscCall(negative_pivots(shift, &below));
  } else {
    for (shift = NEAR * size_; shift < FARTHER * FARTHER * widest_ || below > 0; shift *= FARTHER) {
      PetscCall(negative_pivots(-shift, &below));
      if (below == 0) break;
    }
    shift = -shift;
  }
  PetscCall(EPSGetST(eps_, &st));
  PetscCall(EPSSetTarget(eps_, shift));
  PetscCall(EPSSetWhichEigenpairs(eps_, EPS_TARGET_MAGNITUDE));
  PetscCall(STSetShift(st, shift));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::find_more(PetscInt more, std::string* why) {
  EPSConvergedReason reason;
  PetscInt converged = 0, its = 0;
  PetscBool lapack = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(EPSSetDimensions(eps_, more, basis_, projected_));
  std::vector<Vec> known;
  if (!request_.keep_rigid)
    for (const VecHandle& u : rigid_) known.push_back(u);
  for (const Mode& mode : found_) known.push_back(mode.u);
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(eps_.get()), EPSLAPACK, &lapack));
  if (!lapack && !known.empty()) PetscCall(EPSSetDeflationSpace(eps_, static_cast<PetscInt>(known.size()), known.data()));
  PetscCall(EPSSolve(eps_));
  PetscCall(EPSGetConvergedReason(eps_, &reason));
  PetscCall(EPSGetConverged(eps_, &converged));
  PetscCall(EPSGetIterationNumber(eps_, &its));
  iterations_ += its;
  for (PetscInt k = 0; k < converged; ++k) {
    Mode mode;
    PetscCall(form_.create_vector(mode.u.out()));
    PetscCall(EPSGetEigenvector(eps_, k, mode.u, nullptr));
    PetscCall(judge(&mode));
    found_.push_back(std::move(mode));
  }
  if (converged < more)
    *why = format("%lld of %lld modes converged in %lld iterations (%s): give a larger -eps_max_it or -eps_ncv, or another -bs_modes_solver",
                  static_cast<long long>(converged), static_cast<long long>(more), static_cast<long long>(its), EPSConvergedReasons[reason]);
  PetscFunctionReturn(0);
}

/// Whether as many omega^2 lie below a gap behind the last mode that counts as were found there.
PetscErrorCode ModeSolver::count_all(bool* complete) {
  PetscInt below = 0, counted = 0;
  PetscFunctionBegin;
  *complete = false;
  sort();
  std::size_t last = 0;
  for (; last < found_.size() && counted < request_.count; ++last) counted += request_.keep_rigid || !found_[last].zero ? 1 : 0;
  double widest = 0, shift = 0;
  PetscInt expected = 0;
  for (std::size_t k = last; k < found_.size(); ++k) {  // between k - 1 and k
    const double low = found_[k - 1].omega_squared, high = found_[k].omega_squared, gap = (high - low) / std::max(std::abs(high), ZERO * size_);
    if (gap <= widest) continue;
    widest = gap;
    shift = 0.5 * (low + high);
    expected = static_cast<PetscInt>(k);
  }
  if (widest < 1e-9) PetscFunctionReturn(0);
  if (!request_.keep_rigid && shift > 0) expected += static_cast<PetscInt>(rigid_.size());
  PetscCall(negative_pivots(shift, &below));
  *complete = below == expected;
  PetscFunctionReturn(0);
}

void ModeSolver::finish(Modes* out) {
  sort();
  out->iterations = iterations_;
  out->rigid = static_cast<PetscInt>(rigid_.size());
  out->zero = request_.keep_rigid || request_.method == ModeRequest::dense ? 0 : out->rigid;
  std::vector<Mode> kept;
  for (Mode& mode : found_) {
    if (mode.zero) ++out->zero;
    else if (mode.omega_squared < 0) ++out->unstable;
    if (request_.keep_rigid || !mode.zero) kept.push_back(std::move(mode));
  }
  found_.clear();
  const std::size_t count = std::min(kept.size(), static_cast<std::size_t>(request_.count));
  if (request_.which == ModeRequest::largest) kept.erase(kept.begin(), kept.end() - static_cast<std::ptrdiff_t>(count));
  if (request_.which == ModeRequest::target) {
    const double near = request_.near;
    const auto closer = [near](const Mode& a, const Mode& b) { return std::abs(a.omega_squared - near) < std::abs(b.omega_squared - near); };
    std::sort(kept.begin(), kept.end(), closer);
  }
  kept.resize(count);
  std::sort(kept.begin(), kept.end(), [](const Mode& a, const Mode& b) { return a.omega_squared < b.omega_squared; });
  out->mode = std::move(kept);
}

void ModeSolver::release() {
  eps_.reset();
  A_.reset();
  form_.release_matrices();
}

PetscErrorCode ModeSolver::solve(Modes* out, std::string* why) {
  constexpr int PASSES = 20;
  const bool direct = request_.method == ModeRequest::direct && request_.which == ModeRequest::smallest;
  PetscFunctionBegin;
  why->clear();
  PetscCall(rigid_motions(form_, y_, diagonal_, &rigid_));
  if (request_.method == ModeRequest::dense) {
    PetscCall(find_more(form_.unknowns(), why));
    out->counted = why->empty();
    finish(out);
    PetscFunctionReturn(0);
  }
  if (request_.method == ModeRequest::direct && request_.which != ModeRequest::largest) PetscCall(place_shift());
  if (request_.keep_rigid)
    for (const VecHandle& u : rigid_) {
      Mode mode;
      PetscCall(VecDuplicate(u, mode.u.out()));
      PetscCall(VecCopy(u, mode.u));
      PetscCall(judge(&mode));
      found_.push_back(std::move(mode));
    }
  for (int pass = 0; pass < PASSES && why->empty(); ++pass) {
    const PetscInt known = static_cast<PetscInt>(found_.size() + (request_.keep_rigid ? 0 : rigid_.size()));
    const PetscInt missing = std::max<PetscInt>(wanted(), 0), left = form_.unknowns() - known;
    if (missing == 0 && direct) PetscCall(count_all(&out->counted));
    if (left == 0 || (missing == 0 && (out->counted || !direct))) break;
    PetscCall(find_more(std::min(missing + GUARD, left), why));
  }
  if (why->empty() && direct && !out->counted && form_.unknowns() > static_cast<PetscInt>(found_.size() + rigid_.size()))
    *why = "modes are missing among those found, as the factors' signs show: give a larger -eps_ncv";
  finish(out);
  PetscFunctionReturn(0);
}

}  // namespace bs
