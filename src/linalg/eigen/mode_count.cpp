// What is known of modes that a search may have passed over.
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/error.hpp"
#include "base/factor_memory.hpp"
#include "base/handle.hpp"
#include "linalg/eigen/mode_solver.hpp"

namespace bs {
namespace {

/// Distances of omega^2 that are less than this apart count as equal: relative to omega^2, and to the mean of A's sizes.
constexpr double EQUAL = 1e-9, NOTHING = 1e-13;

}  // namespace

double ModeSolver::distance(double omega_squared) const {
  return request_.which == ModeRequest::smallest  ? omega_squared
         : request_.which == ModeRequest::largest ? -omega_squared
                                                  : std::abs(omega_squared - request_.near);
}

/// Behind the K-th mode, in the widest gap; where those behind it are all copies of the K-th, just before the first of these: then the list is
/// complete as long as nothing is missing before them.
ModeSolver::Edge ModeSolver::edge() const {
  struct Known {
    double omega_squared;
    bool counts, rigid;
  };
  std::vector<Known> known;
  for (const Mode& mode : found_)
    known.push_back({mode.omega_squared, request_.keep_rigid || !mode.zero, request_.keep_rigid && known.size() < rigid_.size()});
  if (!request_.keep_rigid) known.insert(known.end(), rigid_.size(), {0.0, false, true});
  const auto nearer = [this](const Known& a, const Known& b) { return distance(a.omega_squared) < distance(b.omega_squared); };
  std::sort(known.begin(), known.end(), nearer);
  std::size_t last = 0;
  for (PetscInt counted = 0; last < known.size() && counted < request_.count; ++last) counted += known[last].counts ? 1 : 0;
  const auto size = [&](std::size_t k) { return std::abs(known[k].omega_squared); };
  const auto scale = [&](std::size_t k) { return std::max({size(k - 1), size(k), NOTHING / EQUAL * size_}); };
  const auto gap = [&](std::size_t k) { return distance(known[k].omega_squared) - distance(known[k - 1].omega_squared); };  // before k
  Edge edge;
  double widest = EQUAL;
  for (std::size_t k = last; k < known.size() && !known[k].rigid; ++k) {  // rigid motions were not met on the way from the K-th mode
    if (gap(k) / scale(k) <= widest) continue;
    widest = gap(k) / scale(k);
    edge = {distance(known[k - 1].omega_squared) + 0.5 * gap(k), static_cast<PetscInt>(k)};
  }
  if (edge.within > 0) return edge;
  std::size_t first = last - 1;
  while (first > 0 && gap(first) <= EQUAL * scale(first)) --first;
  double before = 10 * std::max(EQUAL * size(first), NOTHING * size_);
  if (first > 0) before = std::min(before, 0.5 * gap(first));
  return {distance(known[first].omega_squared) - before, static_cast<PetscInt>(first)};
}

/// Factors that failed have no signs.
PetscErrorCode ModeSolver::refuse_failed_factors(PC pc) const {
  constexpr char OTHER[] = "-bs_modes_solver iterative or dense";
  PCFailedReason reason;
  MemoryLack lack;
  PetscFunctionBegin;
  PetscCall(PCGetFailedReason(pc, &reason));
  if (reason == PC_NOERROR) PetscFunctionReturn(0);
  PetscCall(find_memory_lack(form_.comm(), pc, &lack));
  PetscCall(fail(form_.comm(), Exit::solve, lack.yes ? lack.said(OTHER) : std::string("the factors that count omega^2 failed: give ") + OTHER));
  PetscFunctionReturn(0);
}

/// Sylvester's law of inertia, of A - shift I + diag(`raise`).
PetscErrorCode ModeSolver::negative_pivots(double shift, Vec raise, PetscInt* count) {
  PC pc;
  Mat factors = nullptr;
  PetscInt zero = 0, positive = 0;
  PetscFunctionBegin;
  if (!shifted_) {
    PetscCall(MatDuplicate(A_, MAT_COPY_VALUES, shifted_.out()));
    PetscCall(MatSetOption(shifted_, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(KSPCreate(form_.comm(), counter_.out()));
    PetscCall(KSPSetOperators(counter_, shifted_, shifted_));
    PetscCall(set_sparse_factors(counter_));
  } else {
    PetscCall(MatCopy(A_, shifted_, SAME_NONZERO_PATTERN));
  }
  PetscCall(MatShift(shifted_, -shift));
  if (raise) PetscCall(MatDiagonalSet(shifted_, raise, ADD_VALUES));
  PetscCall(KSPSetOperators(counter_, shifted_, shifted_));  // it has new values
  PetscCall(set_up_solver(counter_));
  PetscCall(KSPGetPC(counter_, &pc));
  PetscCall(refuse_failed_factors(pc));
  PetscCall(PCFactorGetMatrix(pc, &factors));
  PetscCall(MatGetInertia(factors, count, &zero, &positive));
  PetscFunctionReturn(0);
}

/// Eigenvalues of A below `shift`.
PetscErrorCode ModeSolver::count_below(double shift, PetscInt* count) {
  PetscFunctionBegin;
  PetscCall(negative_pivots(shift, nullptr, count));
  PetscFunctionReturn(0);
}

PetscErrorCode ModeSolver::count_within(double edge, PetscInt* count) {
  PetscInt below = 0;
  PetscFunctionBegin;
  *count = 0;
  if (request_.which == ModeRequest::smallest) {
    PetscCall(count_below(edge, count));
  } else if (request_.which == ModeRequest::largest) {
    PetscCall(count_below(-edge, &below));
    *count = form_.unknowns() - below;
  } else if (edge > 0) {
    PetscCall(count_below(request_.near - edge, &below));
    PetscCall(count_below(request_.near + edge, count));
    *count -= below;
  }
  PetscFunctionReturn(0);
}

/// By factors. Where the count says that some are missing, these are sought.
PetscErrorCode ModeSolver::count(bool* done, std::string* why) {
  const Edge known = edge();
  PetscInt there = 0;
  PetscFunctionBegin;
  PetscCall(count_within(known.at, &there));
  *done = there <= known.within;
  if (there == known.within) {
    completeness_ = Completeness::counted;
    edge_ = known.at;
  }
  bool all = true;
  if (!*done) PetscCall(find_some(std::min(there - known.within + GUARD, left()), &all, why));
  PetscFunctionReturn(0);
}

/// Without factors: whether a search beside all that are found meets one that belongs among them.
PetscErrorCode ModeSolver::search_again(bool* done) {
  const std::size_t before = found_.size();
  std::string why;
  PetscFunctionBegin;
  std::vector<double> wanted;
  for (const Mode& mode : found_)
    if (request_.keep_rigid || !mode.zero) wanted.push_back(distance(mode.omega_squared));
  std::sort(wanted.begin(), wanted.end());
  const double last = wanted[static_cast<std::size_t>(request_.count) - 1];
  PetscCall(find_more(std::min(GUARD, left()), &why));
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t k = before; k < found_.size(); ++k) nearest = std::min(nearest, distance(found_[k].omega_squared));
  const bool nothing = nearest >= last - std::max(EQUAL * std::abs(last), NOTHING * size_);
  *done = nothing || !why.empty();
  if (nothing && why.empty()) {
    completeness_ = Completeness::searched;
    edge_ = last;
  }
  PetscFunctionReturn(0);
}

// A + c diag(s) has as many negative eigenvalues as there are independent u with u.A u < -c u.s u: motions that rounding cannot make unstable
PetscErrorCode ModeSolver::count_unstable(Modes* out) {
  constexpr double ROUNDING = 1e-12;
  VecHandle add;
  const PetscInt met = out->unstable;
  PetscFunctionBegin;
  PetscCall(copy_into(&add, sizes_));
  PetscCall(VecScale(add, ROUNDING));
  PetscCall(negative_pivots(0, add, &out->unstable));
  out->unstable = std::max(out->unstable, met);
  out->unstable_exact = true;
  PetscFunctionReturn(0);
}

}  // namespace bs
