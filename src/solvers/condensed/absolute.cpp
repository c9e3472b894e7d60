#include "solvers/condensed/absolute.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <utility>

namespace bs {

// y = |T|^-1 e_1 first. A negative curvature below LEAST of P's says little of how far to go.
PetscErrorCode AbsoluteSolve::find_coordinates(bool* negative) {
  constexpr double LEAST = 0.05;
  const PetscBLASInt n = static_cast<PetscBLASInt>(diagonal_.size());
  PetscBLASInt info = 0;
  const auto size = static_cast<std::size_t>(n);
  std::vector<double> values = diagonal_, e = beside_, z(size * size), work(2 * size);
  PetscFunctionBegin;
  e.resize(size);
  PetscCallBLAS("LAPACKsteqr", LAPACKsteqr_("I", &n, values.data(), e.data(), z.data(), &n, work.data(), &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK's steqr failed");
  *negative = values.front() <= 0;
  y_.assign(size, 0.0);
  for (std::size_t k = 0; k < size; ++k) {
    const double curvature = values[k] > 0 ? values[k] : std::max(-values[k], LEAST);
    const double part = first_ * z[k * size] / curvature;
    for (std::size_t i = 0; i < size; ++i) y_[i] += part * z[k * size + i];
  }
  PetscFunctionReturn(0);
}

PetscErrorCode AbsoluteSolve::begin(Vec b, Vec w) {
  PetscFunctionBegin;
  for (VecHandle* room : {&now_, &before_, &next_})
    if (!*room) PetscCall(VecDuplicate(b, room->out()));
  diagonal_.clear();
  beside_.clear();
  norm_ = first_ = 0;
  PetscCall(VecCopy(b, now_));
  PetscCall(VecZeroEntries(before_));
  PetscCall(VecZeroEntries(w));
  PetscFunctionReturn(0);
}

// With r the residual: beta^2 = r.P^-1 r, the next column v = P^-1 r/beta. ends: there is none.
PetscErrorCode AbsoluteSolve::weigh(PC P, bool* ends) {
  PetscScalar product = 0;
  PetscFunctionBegin;
  const std::size_t k = diagonal_.size();
  if (basis_.size() <= k) {
    basis_.emplace_back();
    PetscCall(VecDuplicate(now_, basis_.back().out()));
  }
  PetscCall(PCApply(P, now_, basis_[k]));
  PetscCall(VecDot(now_, basis_[k], &product));
  *ends = !(product > 0) || !std::isfinite(product);
  norm_ = *ends ? 0 : std::sqrt(product);
  if (k == 0) first_ = norm_;
  if (*ends) PetscFunctionReturn(0);
  PetscCall(VecScale(basis_[k], 1 / norm_));
  PetscCall(VecScale(now_, 1 / norm_));
  PetscFunctionReturn(0);
}

// alpha = v.S v, the next residual r = S v - alpha P v - beta P v_before
PetscErrorCode AbsoluteSolve::extend(Mat S) {
  PetscScalar alpha = 0;
  PetscFunctionBegin;
  const std::size_t k = diagonal_.size();
  if (k > 0) beside_.push_back(norm_);
  PetscCall(MatMult(S, basis_[k], next_));
  if (k > 0) PetscCall(VecAXPY(next_, -norm_, before_));
  PetscCall(VecDot(next_, basis_[k], &alpha));
  PetscCall(VecAXPY(next_, -alpha, now_));
  diagonal_.push_back(alpha);
  std::swap(before_, now_);
  std::swap(now_, next_);
  PetscFunctionReturn(0);
}

PetscErrorCode AbsoluteSolve::solve(Mat S, PC P, Vec b, Vec w, double rtol, double loose, Outcome* out) {
  constexpr double SPARSE = 1.1;  // coordinates cost k^3: they are looked at ever less often
  PetscInt look = 1;
  bool ends = false;
  PetscFunctionBegin;
  *out = {};
  PetscCall(begin(b, w));
  for (PetscInt k = 0; k < MOST; ++k) {
    PetscCall(weigh(P, &ends));
    if (ends) break;
    if (k == look) {
      PetscCall(find_coordinates(&out->negative));
      if (norm_ * std::abs(y_.back()) < (out->negative ? loose : rtol) * first_) break;
      look = 1 + static_cast<PetscInt>(SPARSE * static_cast<double>(k));
    }
    PetscCall(extend(S));
    if (!std::isfinite(diagonal_.back())) PetscFunctionReturn(0);
  }
  out->iterations = static_cast<PetscInt>(diagonal_.size());
  out->sound = !diagonal_.empty();
  if (!out->sound) PetscFunctionReturn(0);
  PetscCall(find_coordinates(&out->negative));
  std::vector<Vec> columns(basis_.begin(), basis_.begin() + out->iterations);
  PetscCall(VecMAXPY(w, out->iterations, y_.data(), columns.data()));
  PetscFunctionReturn(0);
}

}  // namespace bs
