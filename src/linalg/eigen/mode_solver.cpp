#include "linalg/eigen/mode_solver.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "linalg/eigen/standard_form.hpp"

namespace bs {
namespace {

constexpr double ZERO = 1e-13;  // omega^2 relative to the stiffness of all springs at the particles that move: below it is rounding

/// Mean and maximum over all ranks of what `a` holds: log mean of the positive entries, largest size.
PetscErrorCode log_mean(Vec a, double* mean, double* widest) {
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
  PetscCall(sum_over_ranks(PetscObjectComm(reinterpret_cast<PetscObject>(a)), sums, 2));
  PetscCall(VecNorm(a, NORM_INFINITY, &most));
  *mean = sums[1] > 0 ? std::exp(sums[0] / sums[1]) : 1.0;
  *widest = most;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode ModeSolver::measure() {
  PetscFunctionBegin;
  PetscCall(log_mean(sizes_, &size_, &widest_));
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
  PetscCall(VecPointwiseMult(each, mode->u, sizes_));
  PetscCall(VecDot(each, mode->u, &size));
  mode->omega_squared = value;
  mode->residual = left;
  mode->zero = std::abs(value) <= ZERO * size || (value < 0 && -value <= left);
  PetscFunctionReturn(0);
}

/// How many that count are still to be found.
PetscInt ModeSolver::wanted() const {
  PetscInt have = 0;
  for (const Mode& mode : found_) have += request_.keep_rigid || !mode.zero ? 1 : 0;
  return request_.count - have;
}

/// How many eigenvalues of A are not known yet.
PetscInt ModeSolver::left() const { return form_.unknowns() - static_cast<PetscInt>(found_.size() + (request_.keep_rigid ? 0 : rigid_.size())); }

/// A shift below all omega^2, near the smallest; or near the target.
PetscErrorCode ModeSolver::place_shift() {
  constexpr double NEAR = 1e-8, FARTHER = 16;
  ST st;
  PetscInt below = 1;
  double shift = 0;
  PetscFunctionBegin;
  if (request_.which == ModeRequest::target) {
    shift = request_.near + NEAR * std::max(std::abs(request_.near), size_);  // the target may be an omega^2, where A - shift I is singular
  } else {
    for (shift = NEAR * size_; shift < FARTHER * FARTHER * widest_ || below > 0; shift *= FARTHER) {
      PetscCall(count_below(-shift, &below));
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

/// Makes u orthogonal to all that is known. `fresh`: it was not made of that: where a Krylov space is exhausted, copies of known modes come again.
PetscErrorCode ModeSolver::separate(Vec u, bool* fresh) {
  PetscReal before = 0, after = 0;
  std::vector<Vec> known;
  PetscFunctionBegin;
  if (!request_.keep_rigid) known.assign(rigid_.begin(), rigid_.end());
  for (const Mode& mode : found_) known.push_back(mode.u);
  std::vector<PetscScalar> share(known.size());
  PetscCall(VecNorm(u, NORM_2, &before));
  for (int twice = 0; twice < 2 && !known.empty(); ++twice) {
    PetscCall(VecMDot(u, static_cast<PetscInt>(known.size()), known.data(), share.data()));
    for (PetscScalar& s : share) s = -s;
    PetscCall(VecMAXPY(u, static_cast<PetscInt>(known.size()), share.data(), known.data()));
  }
  PetscCall(VecNorm(u, NORM_2, &after));
  *fresh = after > 0.5 * before;
  PetscFunctionReturn(0);
}

/// Whether what is left of A u - omega^2 u is small, whatever the solver says.
bool ModeSolver::good(const Mode& mode) const {
  constexpr double GOOD = 1e-6, ROUNDING = 1e-9;
  return mode.residual <= std::max(GOOD * std::abs(mode.omega_squared), ROUNDING * widest_);
}

// SLEPc's gd ends with an error where all that it searches in has converged at once, as motions without stiffness may: it begins anew then.
PetscErrorCode ModeSolver::run_solver(bool* exhausted) {
  PetscBool gd = PETSC_FALSE;
  PetscFunctionBegin;
  *exhausted = false;
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(eps_.get()), EPSGD, &gd));
  if (gd) PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
  const PetscErrorCode failed = EPSSolve(eps_);
  if (gd) PetscCall(PetscPopErrorHandler());
  if (!gd) PetscCall(failed);
  *exhausted = failed == PETSC_ERR_ORDER;
  PetscCheck(!failed || *exhausted, form_.comm(), failed, "the eigensolver gd failed");
  if (*exhausted) PetscCall(create_solver());
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::find_more(PetscInt more, std::string* why) {
  EPSConvergedReason reason;
  PetscInt converged = 0, its = 0;
  PetscBool lapack = PETSC_FALSE;
  PetscFunctionBegin;
  const PetscInt room = basis_for(more);
  PetscCall(EPSSetDimensions(eps_, more, basis_ > more ? basis_ : basis_ > 0 ? room : PETSC_DEFAULT, projected_));
  std::vector<Vec> known;
  if (!request_.keep_rigid)
    for (const VecHandle& u : rigid_) known.push_back(u);
  for (const Mode& mode : found_) known.push_back(mode.u);
  PetscCall(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(eps_.get()), EPSLAPACK, &lapack));
  if (!lapack && !known.empty()) PetscCall(EPSSetDeflationSpace(eps_, static_cast<PetscInt>(known.size()), known.data()));
  PetscCall(run_solver(&exhausted_));
  if (exhausted_) {
    *why = "eigensolver gd has nothing left to search in: give another -bs_modes_solver";
    PetscFunctionReturn(0);
  }
  PetscCall(EPSGetConvergedReason(eps_, &reason));
  PetscCall(EPSGetConverged(eps_, &converged));
  PetscCall(EPSGetIterationNumber(eps_, &its));
  iterations_ += its;
  for (PetscInt k = 0; k < converged; ++k) {
    Mode mode;
    PetscCall(form_.create_vector(mode.u.out()));
    PetscCall(EPSGetEigenvector(eps_, k, mode.u, nullptr));
    bool fresh = true;
    if (!lapack) PetscCall(separate(mode.u, &fresh));
    PetscCall(judge(&mode));
    if (lapack || (fresh && good(mode))) found_.push_back(std::move(mode));
  }
  if (converged < more)
    *why = format("%lld of %s converged in %s (%s): give a larger -eps_max_it or -eps_ncv, or another -bs_modes_solver",
                  static_cast<long long>(converged), how_many(more, "mode").c_str(), how_many(its, "iteration").c_str(), EPSConvergedReasons[reason]);
  PetscFunctionReturn(0);
}

/// As find_more, but those that converge are a gain even where the others do not: these are sought anew beside them; likewise, fewer at a time, where
/// none could be told.
PetscErrorCode ModeSolver::find_some(PetscInt more, bool* all, std::string* why) {
  const std::size_t before = found_.size();
  PetscFunctionBegin;
  PetscCall(find_more(more, why));
  *all = why->empty();
  if (found_.size() > before || exhausted_) why->clear();
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::finish(Modes* out, std::string* why) {
  PetscFunctionBegin;
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
  out->completeness = completeness_;
  const bool counted = completeness_ == Completeness::counted, upward = counted && request_.which == ModeRequest::smallest;
  out->zero_exact = counted && (left_ == 0 || (upward && edge_ > ZERO * widest_));
  out->unstable_exact = counted && (left_ == 0 || (upward && edge_ > 0));
  if (!out->unstable_exact && request_.method == ModeRequest::direct) PetscCall(count_unstable(out));
  std::sort(kept.begin(), kept.end(), [this](const Mode& a, const Mode& b) { return distance(a.omega_squared) < distance(b.omega_squared); });
  kept.resize(std::min(kept.size(), static_cast<std::size_t>(request_.count)));
  std::sort(kept.begin(), kept.end(), [](const Mode& a, const Mode& b) { return a.omega_squared < b.omega_squared; });
  for (const Mode& mode : kept)
    if (why->empty() && !good(mode))
      *why = format("the mode with omega^2 = %g has a residual of %g: give a smaller -eps_tol, or another -bs_modes_solver", mode.omega_squared,
                    mode.residual);
  out->mode = std::move(kept);
  PetscFunctionReturn(0);
}

void ModeSolver::release() {
  eps_.reset();
  counter_.reset();
  shifted_.reset();
  A_.reset();
  form_.release_matrices();
}

/// Rigid motions are modes.
PetscErrorCode ModeSolver::keep_rigid() {
  PetscFunctionBegin;
  for (const VecHandle& u : rigid_) {
    Mode mode;
    PetscCall(copy_into(&mode.u, u));
    PetscCall(judge(&mode));
    found_.push_back(std::move(mode));
  }
  PetscFunctionReturn(0);
}

/// Until as many are found as are asked for and none is known to be missing, each time beside those found before.
PetscErrorCode ModeSolver::search(std::string* why) {
  constexpr int PASSES = 20;
  const bool direct = request_.method == ModeRequest::direct;
  PetscInt batch = GUARD;  // grows: nets may have thousands of zero modes, which do not count
  bool done = false;
  PetscFunctionBegin;
  for (int pass = 0; pass < PASSES && !done && left() > 0 && why->empty(); ++pass) {
    const PetscInt more = wanted();
    if (more > 0) {
      bool all = false;
      PetscCall(find_some(std::min(more + (direct ? batch : batch - GUARD), left()), &all, why));
      batch = all ? 2 * batch : GUARD;
    } else {
      PetscCall(direct ? count(&done, why) : search_again(&done));
    }
  }
  if (left() == 0) completeness_ = Completeness::counted;
  else if (why->empty() && wanted() > 0)
    *why = format("%lld of %s were found: give another -bs_modes_solver", static_cast<long long>(request_.count - wanted()),
                  how_many(request_.count, "mode").c_str());
  else if (why->empty() && direct && completeness_ != Completeness::counted)
    *why = "modes are missing among those found, as the factors' signs show: give a larger -eps_ncv, or -bs_modes_solver dense";
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::solve(Modes* out, std::string* why) {
  PetscFunctionBegin;
  why->clear();
  PetscCall(rigid_motions(form_, sizes_, &rigid_));
  if (request_.method == ModeRequest::dense) {
    PetscCall(find_more(form_.unknowns(), why));
    if (why->empty()) completeness_ = Completeness::counted;
    left_ = 0;
  } else {
    if (request_.method == ModeRequest::direct && request_.which != ModeRequest::largest) PetscCall(place_shift());
    if (request_.keep_rigid) PetscCall(keep_rigid());
    PetscCall(search(why));
    left_ = left();
  }
  PetscCall(finish(out, why));
  PetscFunctionReturn(0);
}

}  // namespace bs
