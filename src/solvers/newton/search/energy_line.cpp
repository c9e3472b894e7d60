#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/vec_array.hpp"
#include "solvers/newton/search/energy.hpp"
#include "systems/layout.hpp"

namespace bs {
namespace {

/// Sums over owned particles: a_v . b_v and b_v . b_v.
PetscErrorCode velocity_products(MPI_Comm comm, Vec a, Vec b, double* ab, double* bb) {
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  const ReadArray pa(a), pb(b);
  layout_of(a).for_each([&](PetscInt, PetscInt v) {
    sums[0] += pa[v] * pb[v];
    sums[1] += pb[v] * pb[v];
  });
  PetscCall(sum_over_ranks(comm, sums, 2));
  *ab = sums[0];
  *bb = sums[1];
  PetscFunctionReturn(0);
}

/// z_x = z_v/sigma
PetscErrorCode condense_line(double sigma, Vec z) {
  PetscFunctionBegin;
  const WriteArray a(z);
  layout_of(z).for_each([&](PetscInt x, PetscInt v) { a[x] = a[v] / sigma; });
  PetscFunctionReturn(0);
}

}  // namespace

// With F_x = 0 at (x, v + a), a = M^-1 F_x, and the full step at v - y_v, whose F_x is 0 too:
//   line: dv = -(y_v + a),  dx = dv/sigma
// Newton's linear solve leaves dx = -y_x up to its tolerance. The residual there is F where a = 0, else evaluated.
PetscErrorCode EnergyLine::set_up(Vec residual) {
  ResidualNorms now;
  PetscReal speed = 0;
  PetscFunctionBegin;
  Model& model = newton.model();
  for (VecHandle& work : newton.search.work)
    if (!work) PetscCall(VecDuplicate(start, work.out()));
  line = newton.search.work[0];
  X = newton.search.work[1];
  F = newton.search.work[2];
  PetscCall(VecCopy(Y, line));
  PetscCall(VecCopy(start, X));
  PetscCall(VecCopy(residual, F));
  PetscCall(potential.add_kinematic(F, line));
  PetscCall(VecScale(line, -1.0));
  PetscCall(condense_line(newton.stage.sigma, line));
  PetscCall(model.residual_norms(F, &now));
  PetscCall(potential.add_kinematic(F, X));
  if (now[0] > newton.floor()[0]) PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(velocity_products(model.comm(), F, line, &slope, &speed));
  noise = newton.floor()[1] * std::sqrt(speed);
  PetscCall(potential.follow(X, line));
  most = std::numeric_limits<double>::infinity();
  if (potential.limits_steps()) PetscCall(potential.largest_lambda(newton.stage.time, &most));
  PetscFunctionReturn(0);
}

PetscErrorCode EnergyLine::evaluate(double lambda, PetscReal* fnorm) {
  PetscFunctionBegin;
  if (lambda == 1 && full >= 0) {
    *fnorm = full;
    PetscFunctionReturn(0);
  }
  full = -1;
  if (lambda == 1) PetscCall(VecWAXPY(W, -1.0, Y, start));
  else PetscCall(VecWAXPY(W, lambda, line, X));
  PetscCall(SNESComputeFunction(snes, W, G));
  PetscCall(VecNorm(G, NORM_2, fnorm));
  PetscFunctionReturn(0);
}

// F_x does not count: one Newton step takes it away whatever it does to the forces, and in the units of slow or heavy systems it is the greater part
// of |F|.
PetscErrorCode EnergyLine::forces_left(Vec residual, double* part) const {
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  {
    const ReadArray before(residual), after(G);
    layout_of(G).for_each([&](PetscInt, PetscInt v) {
      sums[0] += before[v] * before[v];
      sums[1] += after[v] * after[v];
    });
  }
  PetscCall(sum_over_ranks(newton.model().comm(), sums, 2));
  *part = sums[1] > 0 ? std::sqrt(sums[1] / sums[0]) : 0;
  PetscFunctionReturn(0);
}

PetscErrorCode EnergyLine::beyond_slope(double lambda, PotentialChange* change) const {
  PetscFunctionBegin;
  PetscCall(potential.beyond_slope(newton.stage.time, newton.stage.sigma, lambda, change));
  PetscFunctionReturn(0);
}

// Hager and Zhang's approximate condition:
//   g(lambda).dv <= (2 alpha - 1) g(0).dv
PetscErrorCode EnergyLine::slope_has_fallen(bool* yes) const {
  double there = 0, speed = 0;
  PetscFunctionBegin;
  PetscCall(velocity_products(newton.model().comm(), G, line, &there, &speed));
  *yes = there <= (2 * limits.alpha - 1) * slope + noise;
  PetscFunctionReturn(0);
}

PetscErrorCode EnergyLine::accept(SNESLineSearch search, Vec residual, PetscReal lambda, PetscReal fnorm) const {
  PetscReal xnorm, ynorm;
  PetscFunctionBegin;
  PetscCall(VecNorm(Y, NORM_2, &ynorm));
  PetscCall(VecCopy(W, start));
  PetscCall(VecCopy(G, residual));
  PetscCall(VecNorm(start, NORM_2, &xnorm));
  PetscCall(SNESLineSearchSetLambda(search, lambda));
  PetscCall(SNESLineSearchSetNorms(search, xnorm, fnorm, ynorm));
  PetscFunctionReturn(0);
}

}  // namespace bs
