#include "systems/equilibrium.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/vec_array.hpp"

namespace bs {

Equilibrium::Equilibrium(std::unique_ptr<Mechanics> mechanics, const LoadRules& rules)
    : FirstOrder(std::move(mechanics)), rules_(rules), factor_(std::numeric_limits<double>::quiet_NaN()) {
  tangent_.set_static(0);
}

PetscErrorCode Equilibrium::begin() {
  PetscFunctionBegin;
  PetscCall(VecDuplicate(initial_state(), rest_.out()));
  PetscCall(zero_velocities(initial_state()));
  if (!rules_.box) load(1);  // it is strained in full from the start, and flows no further
  PetscCall(own_->follow_box(0, initial_state()));
  load(1);
  PetscCall(own_->count_free_bodies(&free_));
  PetscFunctionReturn(0);
}

double Equilibrium::factor(double t) const { return std::isnan(factor_) ? t : factor_; }

void Equilibrium::load(double s) {
  Loads loads;
  load_factor_ = s;
  loads.gravity = rules_.gravity ? s : 1;
  loads.gravity_grows = rules_.gravity;
  loads.factor = s;
  loads.forces_grow = rules_.forces;
  loads.at_rest = true;
  loads.anchors_at_full_load = !rules_.anchors;
  loads.driven_at_full_load = !rules_.driven;
  loads.box_at_full_load = !rules_.box;
  own_->set_loads(loads);
}

PetscErrorCode Equilibrium::at_rest(Vec y) {
  PetscFunctionBegin;
  PetscCall(VecCopy(y, rest_));
  if (!moves()) PetscCall(zero_velocities(rest_));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::set_motion(double h, Vec y) {
  PetscFunctionBegin;
  step_ = h;
  if (!moves()) PetscFunctionReturn(0);
  if (!from_) PetscCall(VecDuplicate(y, from_.out()));
  if (!flow_) PetscCall(VecDuplicate(y, flow_.out()));
  PetscCall(VecCopy(y, from_));
  tangent_.set_dynamic();
  PetscFunctionReturn(0);
}

// y' = (y - y_n)/h, whatever the steps of the load are
PetscErrorCode Equilibrium::momentum(double s, Vec y, Vec F) {
  PetscFunctionBegin;
  PetscCall(VecWAXPY(flow_, -1.0, from_, y));
  PetscCall(VecScale(flow_, 1 / step_));
  PetscCall(FirstOrder::residual(s, y, flow_, Form::momentum, F));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::step_forces(Vec y, Vec F, double* left, double* inertia) {
  const double* masses = own_->masses().data();
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  const Layout at = own_->layout();
  const Linearisation& lin = own_->linearisation();
  const ReadArray a(y), b(moves() ? from_ : y), aF(F);
  const double rate = moves() ? 1 / (step_ * step_) : 0;
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      const double f = masses[i] * (a[at.x(i, c)] - b[at.x(i, c)]) * rate;
      sums[0] += aF[at.v(i, c)] * aF[at.v(i, c)];
      if (lin.moves(i, c)) sums[1] += f * f;
    }
  PetscCall(sum_over_ranks(comm(), sums, 2));
  *left = std::sqrt(sums[0]);
  *inertia = std::sqrt(sums[1]);
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::apply_loads_at(double t, Vec y, double* s) {
  PetscFunctionBegin;
  *s = factor(t);
  load(*s);
  PetscCall(at_rest(y));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::residual(double t, Vec y, Vec ydot, Form, Vec F) {
  const Layout at = own_->layout();
  const double *force = nullptr, *masses = own_->masses().data();
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  if (moves()) {
    PetscCall(momentum(s, y, F));
    PetscFunctionReturn(0);
  }
  PetscCall(own_->force(s, rest_, &force));
  const ReadArray ay(y), ayd(ydot);
  const WriteArray aF(F);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      aF[at.x(i, c)] = masses[i] * (ayd[at.x(i, c)] - ay[at.v(i, c)]);
      aF[at.v(i, c)] = -force[i * at.dim + c];
    }
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::residual_norms(Vec F, ResidualNorms* norms) {
  constexpr double CLOSE = 1e-3, SLOW = 0.1;
  PetscFunctionBegin;
  PetscCall(FirstOrder::residual_norms(F, norms));
  if (moves()) PetscFunctionReturn(0);
  (*norms)[0] = 0;  // v is only a prediction
  const double now = (*norms)[1];
  if (solve_first_ == 0) solve_first_ = now;
  if (floor_ > 0) seen_.loaded = std::max(seen_.loaded, now / floor_);
  seen_.unbalanced_norm = std::max(seen_.unbalanced_norm, now);
  if (solve_before_ > 0 && now < CLOSE * solve_first_ && now > SLOW * solve_before_) sharp_ = true;
  solve_before_ = now;
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::residual_floor(double t, Vec y, double, Form form, ResidualNorms* floor) {
  double s = 0, sum = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  if (moves()) {
    PetscCall(FirstOrder::residual_floor(s, y, 1 / step_, form, floor));
    PetscFunctionReturn(0);
  }
  PetscCall(roundings(s));
  for (const double each : rounding_) sum += each * each;
  PetscCall(sum_over_ranks(comm(), &sum));
  floor_ = std::sqrt(sum);
  *floor = {0, floor_};
  PetscFunctionReturn(0);
}

// The force on each particle beyond its own rounding errors, by the sizes of those that add up to it: beside stiff springs the norm of all forces
// does not see soft ones.
PetscErrorCode Equilibrium::velocity_errors(Vec y, Vec F, double, Form form, double* worst, double* fastest) {
  const Layout at = own_->layout();
  std::vector<double> inner, outer;
  double most = 0;
  PetscFunctionBegin;
  if (moves()) {
    PetscCall(FirstOrder::velocity_errors(y, F, 1 / step_, form, worst, fastest));
    PetscFunctionReturn(0);
  }
  PetscCall(at_rest(y));
  PetscCall(own_->force_sizes(load_factor_, rest_, &inner, &outer));
  const ReadArray a(F);
  for (PetscInt i = 0; i < at.particles; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    double square = 0;
    for (PetscInt c = 0; c < at.dim; ++c) square += a[at.v(i, c)] * a[at.v(i, c)];
    most = std::max(most, share_left(i, std::sqrt(square), inner[k] + outer[k]));
  }
  PetscCall(max_over_ranks(comm(), &most));
  *worst = most;
  *fastest = 1;
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::return_free_bodies(double s_from, Vec from, double t, double h, Vec y) {
  PetscFunctionBegin;
  if (!moves()) PetscCall(own_->return_free_bodies(s_from, from, factor(t), h, y));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::begin_step(const Step& step, Vec y) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(step.t, y, &s));
  PetscCall(own_->begin_step({s, step.h, step.number, step.attempt}, rest_));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::accept(const Step& step, Vec y) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(step.t, y, &s));
  PetscCall(own_->accept({s, step.h, step.number, step.attempt}, rest_));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::observe(double t, Vec y, std::vector<Observable>* out) {
  Balance now;
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(own_->observe(s, rest_, out));
  PetscCall(balance(t, y, &now));
  out->push_back({"released_energy", {released_}});
  out->push_back({"load_factor", {s}});
  out->push_back({"unbalanced_force", {now.left}});
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::energies(double t, Vec y, HeldEnergies* out) {
  constexpr double ROUNDING = 1e-14;
  std::vector<Observable> all;
  EnergySupply supply;
  bool has = false;
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(own_->observe(s, rest_, &all));
  PetscCall(own_->energy_supply(s, rest_, &supply, &has));
  *out = {};
  for (const Observable& one : all) {
    if (one.name == "potential_energy") out->potential = one.value[0];
    if (one.name == "kinetic_energy") out->kinetic = one.value[0];
    if (one.name == "dissipated_energy") out->dissipated = one.value[0];
  }
  out->rounding = supply.rounding + ROUNDING * (std::abs(supply.inner) + std::abs(supply.field));
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::begin_at(double t, Vec y, const HeldEnergies& had) {
  HeldEnergies has;
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(own_->begin_at(s, rest_));
  PetscCall(energies(t, y, &has));
  release(had.sum() - has.sum());
  seen_.unbalanced = 0;  // equilibria of load steps are counted; without loads what is left of the forces is rounding
  PetscFunctionReturn(0);
}

PetscErrorCode Equilibrium::energy_supply(double, Vec, EnergySupply*, bool* has) {
  *has = false;
  return 0;
}

PetscErrorCode Equilibrium::fields(double t, Vec y, std::vector<Field>* out) {
  double s = 0;
  PetscFunctionBegin;
  PetscCall(apply_loads_at(t, y, &s));
  PetscCall(own_->fields(s, rest_, out));
  PetscFunctionReturn(0);
}

}  // namespace bs
