#include "systems/particles/particle_stress.hpp"
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/options.hpp"
#include "systems/particles/constraints/constraints.hpp"

namespace bs {

PetscErrorCode ParticleStress::create(const Network& net) {
  std::vector<std::string> names;
  PetscFunctionBegin;
  net_ = &net;
  count_ = net.dim * (net.dim + 1) / 2;
  PetscCall(read_section(net.comm, "Stress of particles and groups", [&](Section& o) {
    o.flag("-bs_output_stress",
           "write the stress times volume of every particle to every frame: half of every spring's, equal parts of those of angle springs and "
           "hinges, and the kinetic part; their sum is that of a periodic box [J]",
           in_frames_);
    o.texts("-bs_stress_groups", "names of groups whose stress times volume, the sum over their particles, is an observable of every frame [J]",
            names);
    std::string known;
    for (const NetworkGroup& group : net.groups) known += (known.empty() ? "" : ", ") + group.name;
    for (const std::string& name : names) {
      const auto at = std::find_if(net.groups.begin(), net.groups.end(), [&](const NetworkGroup& one) { return one.name == name; });
      if (at == net.groups.end())
        o.fail("option -bs_stress_groups: there is no group " + name + ": choose its particles by -bs_group_" + name +
               (known.empty() ? "" : ", or name some of " + known));
      else groups_.push_back(static_cast<std::size_t>(at - net.groups.begin()));
    }
  }));
  PetscFunctionReturn(0);
}

void ParticleStress::compute(const Terms& terms, double t, const LocalState& state) {
  const int d = net_->dim;
  double L[9];
  values_.assign(static_cast<std::size_t>(net_->n) * static_cast<std::size_t>(count_), 0.0);
  for (const Term* term : terms) term->particle_stress(state, values_.data());
  net_->constraints->box().velocity_gradient(t, L);
  for (PetscInt i = 0; i < net_->n; ++i) {
    if (net_->fixed[i] == 1) continue;
    double c[3];
    beside_flow(d, state.at(i), L, c);
    for (int r = 0; r < d; ++r)
      for (int q = r; q < d; ++q) values_[static_cast<std::size_t>(i * count_ + component_place(d, r, q))] -= net_->inertia[i] * c[r] * c[q];
  }
}

PetscErrorCode ParticleStress::field(const Terms& terms, double t, const LocalState& state, PetscInt rows, Vec* out) {
  PetscFunctionBegin;
  if (!shown_) PetscCall(create_vec(net_->comm, rows, count_, shown_.out()));
  compute(terms, t, state);
  const std::vector<PetscInt> target(net_->row.begin(), net_->row.end());
  PetscCall(VecSetValuesBlocked(shown_, net_->n, target.data(), values_.data(), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(shown_));
  PetscCall(VecAssemblyEnd(shown_));
  *out = shown_;
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleStress::observe(const Terms& terms, double t, const LocalState& state, std::vector<Observable>* out) {
  PetscFunctionBegin;
  if (groups_.empty()) PetscFunctionReturn(0);
  compute(terms, t, state);
  const std::size_t q = static_cast<std::size_t>(count_);
  std::vector<double> sums(groups_.size() * q, 0.0);
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (const PetscInt i : net_->groups[groups_[g]].member)
      for (std::size_t k = 0; k < q && i < net_->n; ++k) sums[g * q + k] += values_[static_cast<std::size_t>(i) * q + k];
  PetscCall(sum_over_ranks(net_->comm, sums.data(), sums.size()));
  std::vector<double> sum(q, 0.0);
  for (std::size_t k = 0; k < sums.size(); ++k) sum[k % q] += sums[k];
  out->push_back({"stress_volume", std::move(sum)});
  for (std::size_t g = 0; g < groups_.size(); ++g)
    out->push_back({"stress_volume/" + net_->groups[groups_[g]].name,
                    {sums.begin() + static_cast<std::ptrdiff_t>(g * q), sums.begin() + static_cast<std::ptrdiff_t>((g + 1) * q)}});
  PetscFunctionReturn(0);
}

}  // namespace bs
