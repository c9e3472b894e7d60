#include "linalg/condensed/absolute.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <utility>
#include "base/vec_array.hpp"

namespace bs {

PetscErrorCode AbsoluteSolve::keep() {
  PetscInt n = 0;
  PetscFunctionBegin;
  const std::size_t k = diagonal_.size();
  if (k >= static_cast<std::size_t>(KEPT)) PetscFunctionReturn(0);
  if (basis_.size() <= k) basis_.emplace_back();
  PetscCall(VecGetLocalSize(column_, &n));
  const ReadArray v(column_);
  basis_[k].assign(v.data(), v.data() + n);
  PetscFunctionReturn(0);
}

/// w = V y
PetscErrorCode AbsoluteSolve::combine(Vec w) const {
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(w));
  const WriteArray sum(w);
  for (std::size_t k = 0; k < y_.size(); ++k) {
    const float* v = basis_[k].data();
    const double part = y_[k];
    for (std::size_t i = 0, n = basis_[k].size(); i < n; ++i) sum[i] += part * static_cast<double>(v[i]);
  }
  PetscFunctionReturn(0);
}

// y = |T|^-1 e_1 first. Curvature below LEAST of P's says little of how far to go where it may have either sign.
PetscErrorCode AbsoluteSolve::find_coordinates() {
  constexpr double LEAST = 0.01;
  const PetscBLASInt n = static_cast<PetscBLASInt>(diagonal_.size());
  PetscBLASInt info = 0;
  const auto size = static_cast<std::size_t>(n);
  std::vector<double> values = diagonal_, e = beside_, z(size * size), work(2 * size);
  PetscFunctionBegin;
  e.resize(size);
  PetscCallBLAS("LAPACKsteqr", LAPACKsteqr_("I", &n, values.data(), e.data(), z.data(), &n, work.data(), &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK's steqr failed");
  y_.assign(size, 0.0);
  for (std::size_t k = 0; k < size; ++k) {
    const double part = first_ * z[k * size] / std::max(std::abs(values[k]), LEAST);
    for (std::size_t i = 0; i < size; ++i) y_[i] += part * z[k * size + i];
  }
  PetscFunctionReturn(0);
}

PetscErrorCode AbsoluteSolve::begin(Vec b, Vec w) {
  PetscFunctionBegin;
  for (VecHandle* room : {&now_, &before_, &next_, &along_, &column_})
    if (!*room) PetscCall(VecDuplicate(b, room->out()));
  definite_ = true;
  next_test_ = 1;
  diagonal_.clear();
  beside_.clear();
  y_.clear();
  norm_ = first_ = pivot_ = advance_ = 0;
  PetscCall(VecCopy(b, now_));
  PetscCall(VecZeroEntries(before_));
  PetscCall(VecZeroEntries(w));
  PetscFunctionReturn(0);
}

// With r the residual: beta^2 = r.P^-1 r, the next column v = P^-1 r/beta. ends: there is none.
PetscErrorCode AbsoluteSolve::weigh(PC P, bool* ends) {
  PetscScalar product = 0;
  PetscFunctionBegin;
  PetscCall(PCApply(P, now_, column_));
  PetscCall(VecDot(now_, column_, &product));
  *ends = !(product > 0) || !std::isfinite(product);
  norm_ = *ends ? 0 : std::sqrt(product);
  if (diagonal_.empty()) first_ = norm_;
  if (*ends) PetscFunctionReturn(0);
  PetscCall(VecScale(column_, 1 / norm_));
  PetscCall(VecScale(now_, 1 / norm_));
  PetscCall(keep());
  PetscFunctionReturn(0);
}

// alpha = v.S v, the next residual r = S v - alpha P v - beta P v_before
PetscErrorCode AbsoluteSolve::extend(Mat S, double* alpha) {
  PetscFunctionBegin;
  const bool first = diagonal_.empty();
  PetscCall(MatMult(S, column_, next_));
  if (!first) PetscCall(VecAXPY(next_, -norm_, before_));
  PetscCall(VecDot(next_, column_, alpha));
  PetscCall(VecAXPY(next_, -*alpha, now_));
  std::swap(before_, now_);
  std::swap(now_, next_);
  PetscFunctionReturn(0);
}

// T = L D L^T: d = alpha - beta^2/d_before, p = v - (beta/d_before) p_before, w += c p with c = -beta c_before/d
PetscErrorCode AbsoluteSolve::conjugate(double alpha, Vec w) {
  PetscFunctionBegin;
  const bool first = diagonal_.empty();
  const double ratio = first ? 0 : norm_ / pivot_, pivot = alpha - ratio * norm_;
  if (!(pivot > 0)) {
    definite_ = false;
    PetscFunctionReturn(0);
  }
  advance_ = first ? first_ / pivot : -norm_ * advance_ / pivot;
  pivot_ = pivot;
  if (first) PetscCall(VecCopy(column_, along_));
  else PetscCall(VecAYPX(along_, -ratio, column_));
  PetscCall(VecAXPY(w, advance_, along_));
  PetscFunctionReturn(0);
}

/// Whether what is left of b is as small as demanded. norm_ is of the residual.
PetscErrorCode AbsoluteSolve::test_residual(const Demand& demand, bool* enough) {
  constexpr double SPARSE = 1.1;  // finding the coordinates costs k^3 operations: the intervals between tests grow
  const auto k = static_cast<double>(diagonal_.size());
  PetscFunctionBegin;
  *enough = false;
  if (definite_) {
    *enough = norm_ * std::abs(advance_) < demand.rtol * first_;
  } else if (k >= next_test_) {
    PetscCall(find_coordinates());
    *enough = norm_ * std::abs(y_.back()) < demand.loose * first_;
    next_test_ = 1 + SPARSE * k;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode AbsoluteSolve::solve(Mat S, PC P, Vec b, Vec w, const Demand& demand, Outcome* out) {
  double alpha = 0;
  bool ends = false;
  PetscFunctionBegin;
  *out = {};
  PetscCall(begin(b, w));
  for (PetscInt k = 0; k < demand.most; ++k) {
    PetscCall(weigh(P, &ends));
    if (!ends && k > 0) PetscCall(test_residual(demand, &ends));
    if (ends || (!definite_ && k >= KEPT)) break;
    PetscCall(extend(S, &alpha));
    if (!std::isfinite(alpha)) PetscFunctionReturn(0);
    if (definite_) PetscCall(conjugate(alpha, w));
    if (k > 0) beside_.push_back(norm_);
    diagonal_.push_back(alpha);
  }
  out->iterations = static_cast<PetscInt>(diagonal_.size());
  out->sound = !diagonal_.empty();
  out->negative = !definite_;
  if (definite_ || diagonal_.size() > static_cast<std::size_t>(KEPT)) PetscFunctionReturn(0);
  if (y_.size() != diagonal_.size()) PetscCall(find_coordinates());
  PetscCall(combine(w));
  PetscFunctionReturn(0);
}

}  // namespace bs
