#include "tasks/strain_relaxation.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/vec_array.hpp"
#include "lattice/box.hpp"
#include "systems/frame_rows.hpp"

namespace bs {

PetscErrorCode StrainRelaxation::set_load(std::size_t a, Vec load) const {
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(load));
  set_half(load, StateHalf::velocity, strained_.force.data() + a * static_cast<std::size_t>(layout_.particles * layout_.dim));
  PetscFunctionReturn(0);
}

PetscErrorCode StrainRelaxation::find(TS ts, Mat J, Equilibrium& model, double t, Vec y) {
  PetscFunctionBegin;
  PetscCall(model.strain_response(t, y, &strained_));
  wanted_.clear();
  PetscCall(relax(ts, J, model, t, y));
  PetscFunctionReturn(0);
}

PetscErrorCode StrainRelaxation::estimate(TS ts, Mat J, Equilibrium& model, double t, Vec y, const Choose& choose) {
  PetscFunctionBegin;
  PetscCall(model.strain_response(t, y, &strained_));
  wanted_ = choose(strained_);
  PetscCall(relax(ts, J, model, t, y));
  PetscFunctionReturn(0);
}

void StrainRelaxation::keep_residual(std::size_t a, Vec r) {
  residual_[a].resize(static_cast<std::size_t>(layout_.particles * layout_.dim));
  get_half(r, StateHalf::velocity, residual_[a].data());
}

PetscErrorCode StrainRelaxation::relax(TS ts, Mat J, Equilibrium& model, double t, Vec y) {
  constexpr double ROUNDING = 1e-13;
  const double good = wanted_.empty() ? GOOD : ROUGH;
  TangentSolve solve;
  VecHandle load;
  PetscFunctionBegin;
  layout_ = model.mechanics()->layout();
  moved_.resize(static_cast<std::size_t>(strained_.count));
  residual_.assign(moved_.size(), {});
  if (!wanted_.empty()) solve.allow_rough();
  if (direct_) solve.use_factors();
  PetscCall(solve.prepare(ts, J, model, t, y));
  PetscCall(VecDuplicate(y, load.out()));
  left_ = 0;
  // a strain that no spring resists has a force of rounding errors alone, which is nothing beside those of other strains
  const double size = strained_.size.empty() ? 0 : *std::max_element(strained_.size.begin(), strained_.size.end());
  for (std::size_t a = 0; a < moved_.size(); ++a) {
    PetscReal norm = 0;
    double one = 0;
    if (!moved_[a]) PetscCall(VecDuplicate(y, moved_[a].out()));
    PetscCall(VecZeroEntries(moved_[a]));
    if (!wanted_.empty() && !wanted_[a]) continue;
    PetscCall(set_load(a, load));
    PetscCall(VecNorm(load, NORM_2, &norm));
    if (norm <= ROUNDING * size) continue;  // every particle follows the strain by itself
    PetscCall(solve.solve(load, moved_[a], good * size / norm, &one));
    keep_residual(a, solve.residual());
    const double part = one * norm / size;
    left_ = part > left_ || std::isnan(part) ? part : left_;
  }
  direct_ = solve.direct();
  lack_ = solve.memory_lack();
  PetscCall(solve.restore_solver());
  PetscCall(reduce(model.comm()));
  PetscFunctionReturn(0);
}

// C = A - X_a.u_b - u_a.r_b with r_b = X_b + K u_b what is left: by the symmetry of K errors of u count by their squares
PetscErrorCode StrainRelaxation::reduce(MPI_Comm comm) {
  const std::size_t q = moved_.size(), size = static_cast<std::size_t>(layout_.particles * layout_.dim);
  std::vector<double> sums(q * q, 0.0);
  PetscFunctionBegin;
  for (std::size_t a = 0; a < q; ++a) {
    const ReadArray u(moved_[a]);
    for (std::size_t b = 0; b < q; ++b)
      for (PetscInt i = 0; i < layout_.particles; ++i)
        for (PetscInt c = 0; c < layout_.dim; ++c) {
          const std::size_t at = static_cast<std::size_t>(i * layout_.dim + c);
          sums[a * q + b] += (strained_.force[b * size + at] + (residual_[b].empty() ? 0 : residual_[b][at])) * u[layout_.x(i, c)];
        }
  }
  PetscCall(sum_over_ranks(comm, sums.data(), sums.size()));
  stiffness_.resize(q * q);
  for (std::size_t a = 0; a < q; ++a)
    for (std::size_t b = 0; b < q; ++b)
      stiffness_[a * q + b] = (strained_.affine[a * q + b] - 0.5 * (sums[a * q + b] + sums[b * q + a])) / strained_.volume;
  PetscFunctionReturn(0);
}

void flow_of(const FreeStrain& one, const double* gradient, int d, double* L) {
  double inverse[9] = {};
  (void)invert_edges(gradient, d, inverse);
  std::fill_n(L, d * d, 0.0);
  for (int c = 0; c < d; ++c) L[one.row * d + c] = inverse[one.column * d + c];
}

std::vector<bool> strains_of(const std::vector<FreeStrain>& free, const double* gradient, int d) {
  std::vector<bool> wanted(static_cast<std::size_t>(d * (d + 1) / 2), false);
  double L[9];
  for (const FreeStrain& one : free) {
    flow_of(one, gradient, d, L);
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c)
        if (L[r * d + c] != 0) wanted[static_cast<std::size_t>(component_place(d, r, c))] = true;
  }
  return wanted;
}

bool solve_small(const std::vector<double>& A, std::vector<double> b, std::vector<double>* x) {
  const PetscBLASInt n = static_cast<PetscBLASInt>(b.size()), one = 1;
  std::vector<double> columns(A.size());  // as LAPACK has them
  std::vector<PetscBLASInt> pivots(b.size());
  PetscBLASInt info = 0;
  for (PetscBLASInt r = 0; r < n; ++r)
    for (PetscBLASInt c = 0; c < n; ++c) columns[static_cast<std::size_t>(c * n + r)] = A[static_cast<std::size_t>(r * n + c)];
  LAPACKgesv_(&n, &one, columns.data(), &n, pivots.data(), b.data(), &n, &info);
  *x = std::move(b);
  return info == 0;
}

namespace {

/// By the signs of the pivots of a symmetric matrix, beside `size`, which its entries would have without cancelling.
BoxState state_of(std::vector<double> A, std::size_t n, double size) {
  constexpr double ROUNDING = 1e-12, CLEAR = 1e-8;
  BoxState state = BoxState::stable;
  for (std::size_t k = 0; k < n; ++k) {
    const double pivot = A[k * n + k];
    if (pivot < -CLEAR * size) return BoxState::unstable;
    if (!(pivot > ROUNDING * size)) {
      state = BoxState::neutral;
      continue;
    }
    for (std::size_t r = k + 1; r < n; ++r)
      for (std::size_t c = k + 1; c < n; ++c) A[r * n + c] -= A[r * n + k] * A[k * n + c] / pivot;
  }
  return state;
}

/// d sigma by the flow L.
void stress_change(const StrainRelaxation& relaxed, const double* sigma, const double* L, int d, double* change) {
  const int q = relaxed.strained().count;
  std::vector<double> strain(static_cast<std::size_t>(q), 0.0);
  double trace = 0;
  for (int r = 0; r < d; ++r) {
    trace += L[r * d + r];
    for (int c = 0; c < d; ++c) strain[static_cast<std::size_t>(component_place(d, r, c))] += L[r * d + c];
  }
  for (int r = 0; r < d; ++r)
    for (int c = 0; c < d; ++c) {
      const int place = component_place(d, r, c);
      double sum = -trace * sigma[r * d + c];
      for (int k = 0; k < q; ++k) sum += relaxed.stiffness()[static_cast<std::size_t>(place * q + k)] * strain[static_cast<std::size_t>(k)];
      for (int k = 0; k < d; ++k) {
        const double e_kc = 0.5 * (L[k * d + c] + L[c * d + k]), e_rk = 0.5 * (L[r * d + k] + L[k * d + r]);
        const double w_kc = 0.5 * (L[k * d + c] - L[c * d + k]), w_rk = 0.5 * (L[r * d + k] - L[k * d + r]);
        sum += 0.5 * (sigma[r * d + k] * e_kc + e_rk * sigma[k * d + c]) + w_rk * sigma[k * d + c] - sigma[r * d + k] * w_kc;
      }
      change[r * d + c] = sum;
    }
}

}  // namespace

BoxState box_tangent(const StrainRelaxation& relaxed, const std::vector<FreeStrain>& free, int d, std::vector<double>* matrix) {
  const StrainResponse& at = relaxed.strained();
  const std::size_t n = free.size(), q = static_cast<std::size_t>(at.count);
  double sigma[9], size = 0;
  for (int r = 0; r < d; ++r)
    for (int c = 0; c < d; ++c) sigma[r * d + c] = at.stress[static_cast<std::size_t>(component_place(d, r, c))];
  for (std::size_t a = 0; a < q; ++a) size = std::max(size, std::abs(at.affine[a * (q + 1)]) / at.volume);
  std::vector<double> flows(n * 9), changes(n * 9), work(n * n);
  for (std::size_t b = 0; b < n; ++b) {
    flow_of(free[b], at.gradient, d, flows.data() + 9 * b);
    stress_change(relaxed, sigma, flows.data() + 9 * b, d, changes.data() + 9 * b);
  }
  matrix->assign(n * n, 0.0);
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b) {
      (*matrix)[a * n + b] = changes[9 * b + static_cast<std::size_t>(free[a].row * d + free[a].column)];
      for (std::size_t k = 0; k < static_cast<std::size_t>(d * d); ++k)
        work[a * n + b] += 0.5 * (flows[9 * a + k] * changes[9 * b + k] + flows[9 * b + k] * changes[9 * a + k]);
    }
  return state_of(std::move(work), n, size);
}

}  // namespace bs
