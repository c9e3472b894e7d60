#include "tasks/strain_relaxation.hpp"
#include <algorithm>
#include <cmath>

namespace bs {

PetscErrorCode StrainRelaxation::set_load(std::size_t a, Vec load) const {
  const std::size_t size = static_cast<std::size_t>(layout_.particles * layout_.dim);
  PetscScalar* f = nullptr;
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(load));
  PetscCall(VecGetArray(load, &f));
  for (PetscInt i = 0; i < layout_.particles; ++i)
    for (PetscInt c = 0; c < layout_.dim; ++c) f[layout_.v(i, c)] = strained_.force[a * size + static_cast<std::size_t>(i * layout_.dim + c)];
  PetscCall(VecRestoreArray(load, &f));
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
  const PetscScalar* from = nullptr;
  residual_[a].resize(static_cast<std::size_t>(layout_.particles * layout_.dim));
  (void)VecGetArrayRead(r, &from);
  for (PetscInt i = 0; i < layout_.particles; ++i)
    for (PetscInt c = 0; c < layout_.dim; ++c) residual_[a][static_cast<std::size_t>(i * layout_.dim + c)] = from[layout_.v(i, c)];
  (void)VecRestoreArrayRead(r, &from);
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
  if (!wanted_.empty()) solve.be_rough();
  if (direct_) solve.be_direct();
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
  PetscCall(solve.give_back());
  PetscCall(reduce(model.comm()));
  PetscFunctionReturn(0);
}

// C = A - X_a.u_b - u_a.r_b with r_b = X_b + K u_b what is left: by the symmetry of K errors of u count by their squares
PetscErrorCode StrainRelaxation::reduce(MPI_Comm comm) {
  const std::size_t q = moved_.size(), size = static_cast<std::size_t>(layout_.particles * layout_.dim);
  std::vector<double> sums(q * q, 0.0);
  PetscFunctionBegin;
  for (std::size_t a = 0; a < q; ++a) {
    const PetscScalar* u = nullptr;
    PetscCall(VecGetArrayRead(moved_[a], &u));
    for (std::size_t b = 0; b < q; ++b)
      for (PetscInt i = 0; i < layout_.particles; ++i)
        for (PetscInt c = 0; c < layout_.dim; ++c) {
          const std::size_t at = static_cast<std::size_t>(i * layout_.dim + c);
          sums[a * q + b] += (strained_.force[b * size + at] + (residual_[b].empty() ? 0 : residual_[b][at])) * u[layout_.x(i, c)];
        }
    PetscCall(VecRestoreArrayRead(moved_[a], &u));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<PetscMPIInt>(sums.size()), MPI_DOUBLE, MPI_SUM, comm));
  stiffness_.resize(q * q);
  for (std::size_t a = 0; a < q; ++a)
    for (std::size_t b = 0; b < q; ++b)
      stiffness_[a * q + b] = (strained_.affine[a * q + b] - 0.5 * (sums[a * q + b] + sums[b * q + a])) / strained_.volume;
  PetscFunctionReturn(0);
}

}  // namespace bs
