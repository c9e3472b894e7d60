// How large residuals of a particle system are, how small they can get, and what went wrong in one.
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/fault.hpp"
#include "model/particles/events.hpp"
#include "model/particles/particle_model.hpp"

namespace bs {

PetscErrorCode ParticleModel::residual_norms(Vec F, ResidualNorms* norms) {
  const PetscScalar* aF = nullptr;
  const PetscInt d = net_.dim, bs = 2 * d;
  *norms = {0, 0};
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(F, &aF));
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt c = 0; c < bs; ++c) (*norms)[c >= d] += aF[i * bs + c] * aF[i * bs + c];
  PetscCall(VecRestoreArrayRead(F, &aF));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, norms->data(), 2, MPI_DOUBLE, MPI_SUM, net_.comm));
  for (double& norm : *norms) norm = std::sqrt(norm);
  PetscFunctionReturn(0);
}

// A particle left with the forces F_v of the momentum form would be sigma m dv = F_v away from its velocity if no spring held
// it, and F_x = m dv; what rounding errors of its own forces make of that is not counted.
PetscErrorCode ParticleModel::velocity_errors(Vec y, Vec F, double sigma, Form form, double* worst, double* fastest) {
  constexpr double NEAR = 100;
  const PetscScalar *ay = nullptr, *aF = nullptr;
  const PetscInt d = net_.dim, bs = 2 * d;
  double high[2] = {0, 0};
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(y, &ay));
  PetscCall(VecGetArrayRead(F, &aF));
  for (PetscInt i = 0; i < net_.n; ++i) {
    const double mass = form == Form::momentum ? net_.mass[i] : 1.0;
    double error = 0, v = 0;
    for (PetscInt c = 0; c < d; ++c) {
      v = std::max(v, std::abs(ay[i * bs + d + c]));
      error = std::max({error, std::abs(aF[i * bs + c]) / mass, std::abs(aF[i * bs + d + c]) / (sigma * mass)});
    }
    high[0] = std::max(high[0], error - NEAR * rounding_[static_cast<std::size_t>(i)]);
    high[1] = std::max(high[1], v);
  }
  PetscCall(VecRestoreArrayRead(F, &aF));
  PetscCall(VecRestoreArrayRead(y, &ay));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, high, 2, MPI_DOUBLE, MPI_MAX, net_.comm));
  *worst = high[0];
  *fastest = high[1];
  PetscFunctionReturn(0);
}

// Rounding of x alone moves the force on a particle by its springs' rates times eps |x|; of v, its momentum; and laws
// that balance (weight and drag) leave the rounding of each.
PetscErrorCode ParticleModel::residual_floor(double t, Vec y, double sigma, Form form, ResidualNorms* floor) {
  const PetscInt d = net_.dim;
  *floor = {0, 0};
  PetscFunctionBegin;
  PetscCall(state_.gather(y));
  std::vector<double> size(static_cast<std::size_t>(net_.n));
  physics_->law_sizes(t, state_, size.data());
  rounding_.assign(static_cast<std::size_t>(net_.n), 0.0);
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt c = 0; c < d; ++c) {
      const double x = std::abs(state_.at(i)[c]), v = std::abs(state_.at(i)[d + c]);
      const double scale = form == Form::momentum ? 1.0 : 1.0 / net_.mass[i];
      const double momentum = net_.fixed[i] ? 0.0 : scale * (2 * rates_[i] * x + net_.mass[i] * sigma * v + size[i]);
      const double kinematic = scale * net_.mass[i] * (sigma * x + v);
      double& rounding = rounding_[static_cast<std::size_t>(i)];
      rounding = std::max(rounding, 2 * PETSC_MACHINE_EPSILON * std::max(momentum / sigma, kinematic) / (scale * net_.mass[i]));
      (*floor)[0] += kinematic * kinematic;
      (*floor)[1] += momentum * momentum;
    }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, floor->data(), 2, MPI_DOUBLE, MPI_SUM, net_.comm));
  for (double& norm : *floor) norm = 2 * PETSC_MACHINE_EPSILON * std::sqrt(norm);
  PetscFunctionReturn(0);
}

// Displacements of 1e-10 of the places may come from rounding and from what Newton leaves. Softening springs may have energies
// below 0: motion can grow by as much.
PetscErrorCode ParticleModel::energy_supply(double t, Vec y, EnergySupply* out, bool* has) {
  const PetscInt d = net_.dim;
  PetscFunctionBegin;
  *has = true;
  PetscCall(PetscLogEventBegin(particle_events().energy, y, nullptr, nullptr, nullptr));
  PetscCall(state_.gather(y));
  if (coupling_.active()) PetscCall(coupling_.gather(net_, state_));
  const Energies e = physics_->energies(t, state_);
  const Supply s = physics_->supply(t, state_, coupling_);
  double sums[10] = {e.kinetic + e.elastic, e.field, s.field, s.coupling, s.fluid, s.pull[0], s.pull[1], s.pull[2], 0, e.elastic};
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt c = 0; c < d; ++c) sums[8] += 1e-20 * rates_[i] * state_.at(i)[c] * state_.at(i)[c];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 10, MPI_DOUBLE, MPI_SUM, net_.comm));
  double ds[3];
  motion_.at(t, out->shift, ds);
  out->inner = sums[0];
  out->field = sums[1];
  out->power = std::abs(sums[2]) + std::abs(sums[3]) + std::abs(sums[4]);
  out->pull = std::hypot(sums[5], sums[6], sums[7]);
  out->speed = std::hypot(ds[0], ds[1], ds[2]);
  out->rounding = sums[8] + std::max(0.0, -sums[9]);
  PetscCall(PetscLogEventEnd(particle_events().energy, y, nullptr, nullptr, nullptr));
  PetscFunctionReturn(0);
}

namespace {

/// What to do about a law that has no value at some place.
std::string advice_on(const std::string& law) {
  const bool central = law == CentralGravity::title;
  return law + " has no value there: lower -ts_dt, or keep the particle away from " + (central ? "-bs_central_point" : "its centre");
}

}  // namespace

/// The smallest row of the gravest kind speaks for all ranks.
PetscErrorCode ParticleModel::last_fault(std::string* text) {
  PetscFunctionBegin;
  std::int64_t key[2] = {fault_.kind == Singularity::none ? 99 : fault_.kind, fault_.row}, low = 0;
  PetscCallMPI(MPI_Allreduce(&key[0], &low, 1, MPI_INT64_T, MPI_MIN, net_.comm));
  text->clear();
  if (low == 99) PetscFunctionReturn(0);
  std::int64_t row = key[0] == low ? key[1] : std::numeric_limits<std::int64_t>::max();
  const std::int64_t mine = row;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &row, 1, MPI_INT64_T, MPI_MIN, net_.comm));
  // its owner knows which law it was, by its place in the list
  std::vector<std::string> titles;
  for_each_law(laws_, [&](const auto& law) { titles.push_back(law.title); });
  int which = mine == row && low == Singularity::particle
                  ? static_cast<int>(std::find(titles.begin(), titles.end(), fault_.law) - titles.begin()) : 0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &which, 1, MPI_INT, MPI_MAX, net_.comm));
  const long long number = static_cast<long long>(row);
  if (low == Singularity::particle)
    *text = format("particle %lld met a place without a force, ", number) + advice_on(titles[static_cast<std::size_t>(which)]);
  else if (low == Singularity::state)
    *text = format("Newton or the step led to a state that is not finite, at particle %lld", number);
  else
    *text = format("%s %lld met zero length, where its law has no direction: lower -ts_dt, keep its ends apart, or give it a rest length of 0",
                   low == Singularity::spring ? "spring" : "anchor", number);
  PetscFunctionReturn(0);
}

}  // namespace bs
