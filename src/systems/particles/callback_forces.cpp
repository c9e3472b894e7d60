#include "systems/particles/callback_forces.hpp"
#include <algorithm>
#include <cmath>
#include "base/context.hpp"

namespace bs {

void CallbackForces::create(const Network& net) {
  net_ = &net;
  callback_ = held_by<ForceCallback>(net.comm);
  if (!active()) return;
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[static_cast<std::size_t>(i)]) free_[net.boundary(i)].push_back(i);
  for (std::vector<PetscInt>& part : free_)
    std::sort(part.begin(), part.end(),
              [&](PetscInt a, PetscInt b) { return net.row[static_cast<std::size_t>(a)] < net.row[static_cast<std::size_t>(b)]; });
}

/// (which, d).
std::vector<double> CallbackForces::evaluate(const std::vector<PetscInt>& which, double t, const LocalState& state) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  std::vector<std::int64_t> row;
  std::vector<double> x, v, f(which.size() * d, 0.0);
  for (const PetscInt i : which) {
    const double* const at = state.at(i);
    row.push_back(net_->row[static_cast<std::size_t>(i)]);
    x.insert(x.end(), at, at + d);
    v.insert(v.end(), at + d, at + 2 * d);
  }
  if (!which.empty()) callback_.force(t, row, x.data(), v.data(), f.data());
  return f;
}

void CallbackForces::forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies*) const {
  const std::vector<PetscInt>& which = free_[static_cast<int>(part)];
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double> some = evaluate(which, t, state);
  for (std::size_t k = 0; k < which.size(); ++k)
    for (std::size_t c = 0; c < d; ++c) {
      const std::size_t i = static_cast<std::size_t>(which[k]);
      f[i * d + c] += some[k * d + c];
      if (!std::isfinite(some[k * d + c]) && fault->kind == Singularity::none) *fault = {Singularity::outside, net_->row[i]};
    }
}

void CallbackForces::forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const {
  const std::vector<double> some = evaluate(which, t, state);
  for (std::size_t k = 0; k < some.size(); ++k) f[k] += some[k];
}

void CallbackForces::supply(double t, const LocalState& state, Supply* sum) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (const std::vector<PetscInt>& which : free_) {
    const std::vector<double> some = evaluate(which, t, state);
    for (std::size_t k = 0; k < which.size(); ++k)
      for (std::size_t c = 0; c < d; ++c) sum->coupling += std::abs(some[k * d + c] * state.at(which[k])[d + c]);
  }
}

void CallbackForces::outer_sizes(double t, const LocalState& state, double* size) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (const std::vector<PetscInt>& which : free_) {
    const std::vector<double> some = evaluate(which, t, state);
    for (std::size_t k = 0; k < which.size(); ++k) {
      double square = 0;
      for (std::size_t c = 0; c < d; ++c) square += some[k * d + c] * some[k * d + c];
      size[which[k]] += std::sqrt(square);
    }
  }
}

}  // namespace bs
