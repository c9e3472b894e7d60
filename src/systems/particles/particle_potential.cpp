#include "systems/particles/particle_potential.hpp"
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/log_event.hpp"
#include "base/vec_array.hpp"

namespace bs {
PetscErrorCode ParticlePotential::create(const Network& net, const Terms& terms, Vec layout, bool coupled) {
  PetscFunctionBegin;
  net_ = &net;
  terms_ = &terms;
  layout_ = layout;
  lacks_ = coupled ? "a force that couples all particles" : terms.lacks_potential();
  PetscCall(first_error(net.comm, {0, lacks_}, &lacks_));  // dampers may be on one rank only, whose answer then holds for all
  PetscFunctionReturn(0);
}

// F_x = M (x' - v)
PetscErrorCode ParticlePotential::add_kinematic(Vec F, Vec y) {
  const Layout at{net_->dim, net_->n};
  PetscFunctionBegin;
  const ReadArray aF(F);
  const WriteArray ay(y);
  for (PetscInt i = 0; i < net_->n; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) ay[at.v(i, c)] += aF[at.x(i, c)] / net_->inertia[i];
  PetscFunctionReturn(0);
}

PetscErrorCode ParticlePotential::follow(Vec y, Vec z) {
  PetscFunctionBegin;
  if (!state_.created()) {
    PetscCall(state_.create(*net_, layout_));
    PetscCall(line_.create(*net_, layout_));
  }
  PetscCall(state_.gather(0.0, y));  // driven particles: beyond_slope knows the time
  PetscCall(line_.gather_direction(z));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticlePotential::beyond_slope(double t, double sigma, double lambda, PotentialChange* change) {
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::potential);
  state_.drive_to(t);
  *change = terms_->beyond_slope(t, state_, line_, lambda, sigma);
  double sums[2] = {change->value, change->noise};
  PetscCall(sum_over_ranks(net_->comm, sums, 2));
  *change = {sums[0], sums[1]};
  PetscFunctionReturn(0);
}

}  // namespace bs
