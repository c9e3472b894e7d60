// How precise the forces of a particle system are, what feeds its energies, and what went wrong in an evaluation.
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/log_event.hpp"
#include "systems/particles/particle_model.hpp"

namespace bs {

namespace {

/// Component by component the largest distance from the origin of an owned particle's place and of all that is linked to it: a particle at the
/// origin feels the rounding of its neighbours' places. far: (n, d)
void farthest_ends(const Network& net, const LocalState& state, std::vector<double>* far) {
  const PetscInt d = net.dim;
  far->resize(static_cast<std::size_t>(net.n * d));
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt c = 0; c < d; ++c) {
      double& most = (*far)[static_cast<std::size_t>(i * d + c)];
      most = std::abs(state.at(i)[c]);
      for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e) most = std::max(most, std::abs(state.at(net.links.other[e])[c]));
    }
  for (std::size_t k = 0; k < net.anchors.particle.size(); ++k)
    for (PetscInt c = 0; c < d; ++c) {
      double& most = (*far)[static_cast<std::size_t>(net.anchors.particle[k] * d + c)];
      most = std::max(most, std::abs(net.anchors.point[k * 3 + static_cast<std::size_t>(c)]));
    }
}

}  // namespace

// Rounding of x alone moves the force on a particle by its springs' rates times eps |x|, and that of velocities by its dampers' times eps |v|; and
// laws that balance (weight and drag) leave the rounding of each. Images across a periodic box are as far away as its edges are long.
PetscErrorCode ParticleModel::force_magnitudes(double t, Vec y, double sigma, double* size) {
  const int d = std::clamp(net_.dim, 1, 3);
  double edges[9] = {}, far[3] = {0, 0, 0};
  PetscFunctionBegin;
  PetscCall(gather(t, y));
  std::vector<double> laws(static_cast<std::size_t>(net_.n)), ends;
  farthest_ends(net_, state_, &ends);
  if (constraints_.box().active()) constraints_.box().edges(t, edges, nullptr);
  for (int k = 0; k < d; ++k)
    for (int c = 0; c < d && net_.box.periodic[k]; ++c) far[c] += std::abs(edges[k * d + c]);
  for (const Term* term : *terms_) {
    term->outer_sizes(t, state_, laws.data());
    if (sigma > 0) term->damping_sizes(t, state_, sigma, laws.data());
  }
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt c = 0; c < d; ++c) size[i * d + c] = 2 * rates_[i] * (ends[static_cast<std::size_t>(i * d + c)] + far[c]) + laws[i];
  constraints_.clear(0, net_.n, 1, size);
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::force_sizes(double t, Vec y, std::vector<double>* inner, std::vector<double>* outer) {
  const std::size_t d = static_cast<std::size_t>(net_.dim);
  const std::vector<PetscInt>& held = constraints_.holders();
  std::vector<double> force(held.size() * d), square(held.size(), 0.0);
  PetscFunctionBegin;
  PetscCall(gather(t, y));
  inner->assign(static_cast<std::size_t>(net_.n), 0.0);
  outer->assign(static_cast<std::size_t>(net_.n), 0.0);
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt e = net_.links.start[i]; e < net_.links.start[i + 1]; ++e)
      if (net_.links.spring[e] >= 0) (*inner)[i] += std::abs(terms_->pairs().measure(state_, i, e).tension);
  for (const Term* term : *terms_) {
    term->inner_sizes(state_, inner->data());
    term->outer_sizes(t, state_, outer->data());
  }
  for (std::size_t k = 0; k < net_.anchors.particle.size(); ++k)
    (*outer)[net_.anchors.particle[k]] += std::abs(terms_->pairs().anchor_tension(t, state_, static_cast<PetscInt>(k)));
  for (const Term* term : *terms_) term->forces_on(held, t, state_, force.data());
  constraints_.for_held([&](std::size_t k, int c) { square[k] += force[k * d + c] * force[k * d + c]; });
  for (std::size_t k = 0; k < held.size(); ++k) (*outer)[held[k]] = std::max((*outer)[held[k]], std::sqrt(square[k]));
  PetscFunctionReturn(0);
}

// Displacements of 1e-10 of the places may come from rounding and from what Newton leaves. Softening springs may have energies
// below 0: motion can grow by as much.
PetscErrorCode ParticleModel::energy_supply(double t, Vec y, EnergySupply* out, bool* has) {
  const PetscInt d = net_.dim;
  PetscFunctionBegin;
  *has = true;
  const LoggedTime logged(LogEvent::energies, y);
  PetscCall(gather(t, y));
  const Energies e = energies_at(t, y);
  Supply s;
  for (const Term* term : *terms_) term->supply(t, state_, &s);
  double sums[10] = {e.kinetic + e.elastic, e.field, s.field, s.coupling, s.fluid, s.pull[0], s.pull[1], s.pull[2], 0, e.elastic};
  for (PetscInt i = 0; i < net_.n; ++i)
    for (PetscInt c = 0; c < d; ++c) sums[8] += 1e-20 * rates_[i] * state_.at(i)[c] * state_.at(i)[c];
  PetscCall(sum_over_ranks(net_.comm, sums, 10));
  double ds[3];
  constraints_.anchors().at(t, out->shift, ds);
  out->inner = sums[0];
  out->field = sums[1];
  out->power = std::abs(sums[2]) + std::abs(sums[3]) + std::abs(sums[4]);
  out->pull = std::hypot(sums[5], sums[6], sums[7]);
  out->speed = std::hypot(ds[0], ds[1], ds[2]);
  out->work = reactions_.path();
  out->rounding = sums[8] + std::max(0.0, -sums[9]);
  PetscFunctionReturn(0);
}

namespace {

/// What to do about a law that has no value at some place.
std::string advice_on(const std::string& law) {
  const bool central = law == CentralGravity::title;
  return law + " has no value there: lower -ts_dt, or keep the particle away from " + (central ? "-bs_central_point" : "its centre");
}

}  // namespace

/// The fault of the most severe kind with the smallest row is reported for all ranks.
PetscErrorCode ParticleModel::last_fault(std::string* text) {
  PetscFunctionBegin;
  std::int64_t key[2] = {fault_.kind == Singularity::none ? 99 : fault_.kind, fault_.row}, low = 0;
  PetscCallMPI(MPI_Allreduce(&key[0], &low, 1, MPI_INT64_T, MPI_MIN, net_.comm));
  text->clear();
  if (low == 99) PetscFunctionReturn(0);
  std::int64_t row = key[0] == low ? key[1] : std::numeric_limits<std::int64_t>::max();
  const std::int64_t mine = row;
  PetscCall(min_over_ranks(net_.comm, &row));
  // its owner knows which law it was, by its place in the list
  std::vector<std::string> titles;
  for_each_law(laws_, [&](const auto& law) { titles.push_back(law.title); });
  int which =
      mine == row && low == Singularity::particle ? static_cast<int>(std::find(titles.begin(), titles.end(), fault_.law) - titles.begin()) : 0;
  PetscCall(max_over_ranks(net_.comm, &which));
  const long long number = static_cast<long long>(row);
  if (low == Singularity::interaction) {
    PetscCall(interaction_fault(net_.comm, mine == row, fault_, text));
    PetscFunctionReturn(0);
  }
  if (low == Singularity::particle)
    *text = format("particle %lld reached a position where a force is not defined: ", number) + advice_on(titles[static_cast<std::size_t>(which)]);
  else if (low == Singularity::state) *text = format("Newton's method or the step produced a state that is not finite, at particle %lld", number);
  else if (low == Singularity::outside) *text = format("the force on particle %lld that is computed outside is not finite", number);
  else
    *text = format(
        "%s %lld reached zero length, where its law has no direction: lower -ts_dt, keep its ends apart, or give it a rest length of 0 and no axial "
        "damper",
        low == Singularity::spring ? "spring" : "anchor", number);
  PetscFunctionReturn(0);
}

}  // namespace bs
