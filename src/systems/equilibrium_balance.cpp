// Whether what a solver calls an equilibrium is one, by forces that are evaluated afresh.
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/text.hpp"
#include "systems/equilibrium.hpp"

namespace bs {
namespace {

constexpr double LEFT = 1e-6;      ///< of the loads, that an equilibrium may leave
constexpr double NEAR = 10;        ///< rounding errors of a particle's force, within which it may be left
constexpr double FAINT = 1e7;      ///< rounding errors of a particle's force, below which the forces on it are next to none
constexpr double SLIGHT = 1e-3;    ///< of the unbalanced forces that load steps begin with, below which forces are next to none, too
constexpr double ALL_LEFT = 1e-3;  ///< of the forces on a single particle, beside which those on others may be large

/// A maximum does not see what is no number.
double or_infinite(double value) { return std::isfinite(value) ? value : std::numeric_limits<double>::infinity(); }

double norm_of(const double* a, PetscInt n) {
  double square = 0;
  for (PetscInt c = 0; c < n; ++c) square += a[c] * a[c];
  return std::sqrt(square);
}

}  // namespace

// From the sizes of what adds up to the force.
PetscErrorCode Equilibrium::roundings(double s) {
  const Layout at = own_->layout();
  std::vector<double> size(static_cast<std::size_t>(at.particles * at.dim));
  PetscFunctionBegin;
  PetscCall(own_->force_magnitudes(s, rest_, 0, size.data()));
  rounding_.resize(static_cast<std::size_t>(at.particles));
  for (PetscInt i = 0; i < at.particles; ++i)
    rounding_[static_cast<std::size_t>(i)] = 2 * PETSC_MACHINE_EPSILON * norm_of(size.data() + i * at.dim, at.dim);
  PetscFunctionReturn(0);
}

double Equilibrium::slight_force(PetscInt k) const {
  return SLIGHT * std::min(seen_.loaded * rounding_[static_cast<std::size_t>(k)], seen_.unbalanced_norm);
}

double Equilibrium::share_left(PetscInt k, double left, double acting) const {
  const double rounding = rounding_[static_cast<std::size_t>(k)], beyond = or_infinite(left - NEAR * rounding);
  return beyond > 0 ? or_infinite(beyond / std::max({acting, FAINT * rounding, slight_force(k)})) : 0;
}

PetscErrorCode Equilibrium::reactions(double t, Vec y, std::vector<double>* out) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(own_->reactions(s, rest_, out));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::balance(double t, Vec y, Balance* out) {
  const Layout at = own_->layout();
  const double* force = nullptr;
  std::vector<double> inner, outer;
  double s = 0, most[6] = {0, 0, 0, 0, 0, 0};
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(roundings(s));
  PetscCall(own_->force_sizes(s, rest_, &inner, &outer));
  PetscCall(own_->force(s, rest_, &force));
  for (PetscInt i = 0; i < at.particles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const double left = or_infinite(norm_of(force + i * at.dim, at.dim));
    most[0] = std::max(most[0], left);
    most[1] = std::max(most[1], left - NEAR * rounding_[k]);
    most[2] = std::max(most[2], inner[k]);
    most[3] = std::max(most[3], outer[k]);
    most[4] = std::max(most[4], share_left(i, left, inner[k] + outer[k]));
    most[5] = std::max(most[5], slight_force(i));
  }
  PetscCall(max_over_ranks(comm(), most, 6));
  *out = {most[0], most[1], most[2], most[3], most[4], most[5]};
  PetscFunctionReturn(0);
}

// missing: what the stress of the box lacks of the one that is given; size: the stresses to measure it by, and what rounding of the strain makes of
// the stiffness
PetscErrorCode Equilibrium::missing_stress(double t, Vec y, double* missing, double* size) {
  constexpr double ROUNDING = 1e-12;
  StrainResponse at;
  PetscFunctionBegin;
  *missing = *size = 0;
  const std::vector<FreeStrain> free = free_strains(t);
  if (free.empty()) PetscFunctionReturn(0);
  PetscCall(strain_response(t, y, &at));
  seen_.stress = std::max(seen_.stress, stress_measure(at, free));
  for (const FreeStrain& one : free)
    *missing =
        std::max(*missing, or_infinite(std::abs(one.stress - at.stress[static_cast<std::size_t>(component_place(dim(), one.row, one.column))])));
  *size = std::max(seen_.stress, ROUNDING / LEFT * stiffness_along(at, free, dim()));
  PetscFunctionReturn(0);
}

double Equilibrium::may_leave(const Balance& b) const { return LEFT * std::max({seen_.inner, b.inner, seen_.outer, b.outer, b.slight}); }

PetscErrorCode Equilibrium::is_balanced(double t, Vec y, bool* yes) {
  Balance b;
  PetscFunctionBegin;
  PetscCall(balance(t, y, &b));
  *yes = b.beyond <= may_leave(b);
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::examine(double t, Vec y, std::string* why, bool* hopeless) {
  constexpr double NOTHING = 1e-9;
  Balance b;
  double missing = 0, size = 0;
  PetscFunctionBegin;
  why->clear();
  *hopeless = false;
  if (moves()) PetscFunctionReturn(0);
  PetscCall(balance(t, y, &b));
  const double inner = std::max(seen_.inner, b.inner), outer = std::max(seen_.outer, b.outer);
  if (!(b.beyond <= may_leave(b))) {
    *why = format("the solver calls it an equilibrium, but an unbalanced force of %.3g N is left on a particle where the largest forces are %.3g N",
                  b.left, std::max(b.inner, b.outer));
    PetscFunctionReturn(0);
  }
  if (!(b.uneven <= ALL_LEFT)) {
    *why = format(
        "an unbalanced force of %.2g of the forces that act on it is left on a particle, whose springs are too soft beside others: compute parts of "
        "so "
        "different stiffness apart",
        b.uneven);
    *hopeless = true;
    PetscFunctionReturn(0);
  }
  PetscCall(missing_stress(t, y, &missing, &size));
  if (!(missing <= LEFT * size)) {
    *why = format("the stress of the box is off by %.3g, measured by stresses of %.3g", missing, seen_.stress);
    PetscFunctionReturn(0);
  }
  seen_.inner = inner;
  seen_.outer = outer;
  // without loads and supports what is left of them is rounding, which measures nothing
  if (((outer > NOTHING * inner && b.left > LEFT * outer) || b.uneven > LEFT) && seen_.loaded > 1) ++seen_.unbalanced;
  PetscFunctionReturn(0);
}

void Equilibrium::keep_sums(const Keeper& keep) {
  FirstOrder::keep_sums(keep);
  keep("largest_inner_force", seen_.inner);
  keep("largest_outer_force", seen_.outer);
  keep("largest_stress", seen_.stress);
  keep("largest_residual", seen_.loaded);
  keep("largest_unbalanced_norm", seen_.unbalanced_norm);
  keep("unbalanced", seen_.unbalanced);
  keep("released_energy", released_);
  keep("mean_rate", rate_);
}

}  // namespace bs
