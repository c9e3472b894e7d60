#include "tasks/statics/saddle_point.hpp"
#include <cmath>
#include <vector>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "time/methods.hpp"

namespace bs {
namespace {

// z.K z > CURVATURE_DOUBT sum s_i |z_i|^2, with the exact K: neither the precision in which S is stored nor its shift counts
PetscErrorCode is_unstable_along(Equilibrium& model, Vec z, bool* yes) {
  Linearisation& lin = model.mechanics()->linearisation();
  const Layout& at = lin.layout();
  std::vector<double> force(static_cast<std::size_t>(at.particles * at.dim)), size(static_cast<std::size_t>(at.particles));
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  PetscCall(lin.change_of_force(z, force.data()));
  lin.stiffness_sizes(size.data());
  const ReadArray a(z);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      sums[0] += a[at.x(i, c)] * force[static_cast<std::size_t>(i * at.dim + c)];
      sums[1] += a[at.x(i, c)] * a[at.x(i, c)] * size[static_cast<std::size_t>(i)];
    }
  PetscCall(sum_over_ranks(model.comm(), sums, 2));
  *yes = sums[0] > CURVATURE_DOUBT * sums[1];
  PetscFunctionReturn(0);
}

/// z = (shift M - K)^-1 r at rest, scaled to a largest component of 1; then r = (0, M z).
PetscErrorCode iterate_inversely(PC pc, const Linearisation& lin, Vec r, Vec z) {
  const Layout& at = lin.layout();
  PetscReal size = 0;
  PetscFunctionBegin;
  PetscCall(PCApply(pc, r, z));
  PetscCall(zero_velocities(z));
  PetscCall(VecNorm(z, NORM_INFINITY, &size));
  if (size > 0) PetscCall(VecScale(z, 1 / size));
  const ReadArray a(z);
  const WriteArray b(r);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) b[at.v(i, c)] = lin.masses()[static_cast<std::size_t>(i)] * a[at.x(i, c)];
  PetscFunctionReturn(0);
}

// Inverse iteration with shift M - K, which is as small as it can be while that is positive definite: the lowest eigenvector outgrows the others.
PetscErrorCode iterate_to_lowest(PC pc, Mat J, Equilibrium& model, double t, Vec y, Vec r, Vec z, bool* found) {
  constexpr double FIRST = 1e-2, RATIO = 8, LEAST = 1e-13, GREATEST = 1e6;
  constexpr int MOST = 40;
  const double rate = model.mean_squared_frequency();
  double shift = FIRST, definite = 0;
  PetscInt negative = 0;
  PetscFunctionBegin;
  PetscCall(model.random_load(r));
  for (; shift > LEAST && shift<GREATEST; shift *= definite> 0 ? 1 / RATIO : RATIO) {
    PetscCall(model.linearise_with(t, y, shift * rate, J));
    PetscCall(condensed_negative_pivots(pc, &negative));
    if (negative != 0 && definite > 0) break;
    if (negative != 0) continue;
    definite = shift;
    PetscCall(iterate_inversely(pc, model.mechanics()->linearisation(), r, z));
  }
  *found = false;
  if (definite == 0) PetscFunctionReturn(0);
  PetscCall(model.linearise_with(t, y, definite * rate, J));
  for (int k = 0; k < MOST && !*found; ++k) {
    PetscCall(iterate_inversely(pc, model.mechanics()->linearisation(), r, z));
    PetscCall(is_unstable_along(model, z, found));
  }
  PetscFunctionReturn(0);
}

/// F.z of the residual's forces at y, for which `F` is room.
PetscErrorCode slope_along(Equilibrium& model, double t, Vec y, Vec z, Vec F, double* slope) {
  const Layout at = model.mechanics()->layout();
  PetscFunctionBegin;
  *slope = 0;
  PetscCall(model.residual(t, y, y, Form::momentum, F));
  const ReadArray a(F), b(z);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) *slope += a[at.v(i, c)] * b[at.x(i, c)];
  PetscCall(sum_over_ranks(model.comm(), slope));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode count_unstable_directions(TS ts, Mat J, Equilibrium& model, double t, Vec y, PetscInt* negative) {
  PC pc;
  PetscFunctionBegin;
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(model.linearise_sharply(t, y, J));
  PetscCall(condensed_negative_pivots(pc, negative));
  PetscFunctionReturn(0);
}

PetscErrorCode search_unstable_direction(TS ts, Equilibrium& model, PetscInt iterations, Vec z, bool* found) {
  VecHandle r;
  PC pc;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(z, r.out()));
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(model.random_load(r));
  PetscCall(condensed_negative_direction(pc, r, iterations, z, found));
  if (!*found) PetscFunctionReturn(0);
  PetscCall(zero_velocities(z));
  PetscCall(is_unstable_along(model, z, found));
  PetscFunctionReturn(0);
}

PetscErrorCode find_unstable_direction(TS ts, Mat J, Equilibrium& model, double t, Vec y, PetscInt iterations, Vec z, PetscInt* negative,
                                       bool* found) {
  VecHandle r;
  PC pc;
  PetscFunctionBegin;
  *found = false;
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(count_unstable_directions(ts, J, model, t, y, negative));
  if (*negative < 0) {
    if (iterations > 0) PetscCall(search_unstable_direction(ts, model, iterations, z, found));
  } else if (*negative > 0) {
    PetscCall(VecDuplicate(y, r.out()));
    PetscCall(iterate_to_lowest(pc, J, model, t, y, r, z, found));
  }
  PetscFunctionReturn(0);
}

// What is beyond the slope is summed without cancellation, so that next to a branch point the smallest falls count, as long as they are larger than
// what the forces that are left of the equilibrium do.
PetscErrorCode step_down(Equilibrium& model, double t, Vec y, Vec z, Vec out, bool* lower) {
  constexpr double TURN = 0.5, RATIO = 0.25;
  constexpr int TRIALS = 12;
  Linearisation& lin = model.mechanics()->linearisation();
  Incremental* potential = model.incremental();
  PetscReal size = 0, length = 0;
  PotentialChange change;
  double part = 1, best = 0, least = 0, slope = 0;
  PetscFunctionBegin;
  *lower = false;
  if (!potential || !potential->lacks_potential().empty()) PetscFunctionReturn(0);
  PetscCall(VecNorm(y, NORM_INFINITY, &size));
  PetscCall(VecNorm(z, NORM_INFINITY, &length));
  if (size > 0 && length > 0) PetscCall(VecScale(z, size / length));
  PetscCall(lin.predict_tensions(z, TURN, &part));
  lin.forget_tensions();
  PetscCall(slope_along(model, t, y, z, out, &slope));
  PetscCall(potential->follow(y, z));
  for (int k = 0; k < 2 * TRIALS; ++k) {
    const double a = k % 2 == 0 ? part : -part;
    PetscCall(potential->beyond_slope(t, 1, a, &change));
    // of two senses that are alike, the first: rounding errors do not choose
    if (change.value + change.noise + std::abs(a * slope) < least) {
      least = change.value - change.noise;
      best = a;
    }
    if (k % 2 == 1) part *= RATIO;
  }
  *lower = best != 0;
  PetscCall(VecWAXPY(out, best, z, y));
  PetscCall(zero_velocities(out));
  PetscFunctionReturn(0);
}

}  // namespace bs
