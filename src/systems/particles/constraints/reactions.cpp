#include "systems/particles/constraints/reactions.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include "base/collective.hpp"
#include "base/dimension.hpp"

namespace bs {

PetscErrorCode Reactions::create(const Network& net, const Terms& terms, const NodalForces& forces) {
  PetscFunctionBegin;
  net_ = &net;
  constraints_ = net.constraints;
  terms_ = &terms;
  for (const NetworkGroup& group : net.groups) {
    GroupRows rows{group.name, {}};
    for (const PetscInt i : group.member)
      if (const std::size_t row = row_of(i); row < constraints_->holders().size()) rows.rows.push_back(row);
    bool some = false;
    PetscCall(on_some_rank(net.comm, !rows.rows.empty(), &some));
    if (some) groups_.push_back(std::move(rows));
  }
  for (const Constraints::Moved& one : constraints_->motions()) {
    place_.push_back(one.drive.moving() ? static_cast<int>(names_.size()) : -1);
    if (one.drive.moving()) names_.push_back(net.groups[one.group].name);
  }
  for (std::size_t k = 0; k < constraints_->holds().size(); ++k) {
    const Constraints::Hold& hold = constraints_->holds()[k];
    if (hold.particle >= net.n || place_[static_cast<std::size_t>(hold.motion)] < 0) continue;
    moved_.push_back(k);
    row_.push_back(row_of(hold.particle));
  }
  box_ = names_.size();
  if (constraints_->box().moving()) names_.emplace_back("box");
  pulled_ = names_.size();
  if (constraints_->anchors().active() && net.anchors_total > 0) names_.emplace_back("anchors");
  grown_ = names_.size();
  if (forces.active()) forces_ = &forces;
  if (forces.varies()) names_.emplace_back("forces");
  work_.assign(names_.size(), 0.0);
  PetscFunctionReturn(0);
}

std::size_t Reactions::row_of(PetscInt particle) const {
  const std::vector<PetscInt>& all = constraints_->holders();
  const auto at = std::lower_bound(all.begin(), all.end(), particle);
  return at != all.end() && *at == particle ? static_cast<std::size_t>(at - all.begin()) : all.size();
}

void Reactions::count_loads(const ParticleLaws* laws) {
  if (counted_) return;
  counted_ = true;
  names_.resize(grown_);
  if (laws)
    for_each_law(*laws, [&](const auto& law) {
      if (has_load<std::decay_t<decltype(law)>>::value && law.active()) loads_ = laws;
    });
  if (forces_ && !forces_->grows()) forces_ = nullptr;
  if (loads_ || forces_) names_.emplace_back("loads");
  work_.assign(names_.size(), 0.0);
}

namespace {

/// G: the energy of gravity under the full loads, of the particles whose energies count.
template <int d>
double full_load_energy(const Network& net, const ParticleLaws& laws, const LocalState& state) {
  double sum = 0;
  for_each_law(laws, [&](const auto& law) {
    using Law = std::decay_t<decltype(law)>;
    if constexpr (has_load<Law>::value) {
      if (!law.active()) return;
      Law full = law;
      full.load = 1;
      for (PetscInt i = 0; i < net.n; ++i) {
        const double* y = state.at(i);
        if (net.fixed[i] != 1) sum += full.template energy<d>({0, net.mass[i], net.columns(i), y, y + d});
      }
    }
  });
  return sum;
}

}  // namespace

void Reactions::measure(double t, const LocalState& state, Moment* out) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  out->force.resize(moved_.empty() ? 0 : constraints_->holders().size() * d);
  if (!moved_.empty())
    for (const Term* term : *terms_) term->forces_on(constraints_->holders(), t, state, out->force.data());
  out->x.resize(moved_.size() * d);
  out->v.resize(out->x.size());
  for (std::size_t k = 0; k < moved_.size(); ++k)
    constraints_->at(constraints_->holds()[moved_[k]], t, out->x.data() + k * d, out->v.data() + k * d, nullptr);
  double rate[3];
  constraints_->anchors().at(t, out->shift, rate);
  std::fill_n(out->pull, 3, 0.0);
  if (constraints_->anchors().active()) terms_->pairs().pull(t, state, out->pull);
  if (loads_) {
    out->load = std::get<UniformGravity>(*loads_).load;
    out->load_energy = with_dimension(net_->dim, [&](auto dim) { return full_load_energy<dim>(*net_, *loads_, state); });
  }
  out->given.clear();
  out->u.clear();
  for (std::size_t k = 0; forces_ && grown_ < names_.size() && k < forces_->loaded().size(); ++k) {
    const PetscInt i = forces_->loaded()[k];
    double f[3];
    if (counted_) forces_->force(k, t, f);
    else forces_->varying(k, t, f);
    for (std::size_t c = 0; c < d; ++c) {
      out->given.push_back(net_->fixed[i] == 1 ? 0 : f[c]);
      out->u.push_back(state.at(i)[c] - net_->held[static_cast<std::size_t>(i) * d + c]);
    }
  }
  if (!constraints_->box().moving()) return;
  out->box = {};
  for (const Term* term : *terms_) term->box_forces(state, &out->box);
  constraints_->box().edges(t, out->edges, nullptr);
}

double Reactions::work_of_forces(const Moment& now) const {
  double work = 0;
  for (std::size_t q = 0; q < now.u.size(); ++q)
    work +=
        counted_ ? -0.5 * (last_.u[q] + now.u[q]) * (now.given[q] - last_.given[q]) : 0.5 * (last_.given[q] + now.given[q]) * (now.u[q] - last_.u[q]);
  return work;
}

void Reactions::begin(double t, const LocalState& state) {
  if (!works() || begun_) return;
  measure(t, state, &last_);
  begun_ = true;
}

void Reactions::renew(double t, const LocalState& state) {
  if (works() && begun_) measure(t, state, &last_);
}

PetscErrorCode Reactions::advance(double t, const LocalState& state) {
  Moment now;
  std::vector<double> step(work_.size(), 0.0);
  PetscFunctionBegin;
  if (!works() || !begun_) PetscFunctionReturn(0);
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  measure(t, state, &now);
  for (std::size_t k = 0; k < moved_.size(); ++k) {
    const Constraints::Hold& hold = constraints_->holds()[moved_[k]];
    double& work = step[static_cast<std::size_t>(place_[static_cast<std::size_t>(hold.motion)])];
    for (std::size_t c = 0; c < d; ++c) {
      if (!(hold.mask >> c & 1)) continue;
      const std::size_t f = row_[k] * d + c, at = k * d + c;
      work -= 0.5 * (last_.force[f] + now.force[f]) * (now.x[at] - last_.x[at]);
      work += 0.5 * net_->inertia[hold.particle] * (now.v[at] - last_.v[at]) * (now.v[at] + last_.v[at]);
    }
  }
  for (std::size_t c = 0; c < d * d && constraints_->box().moving(); ++c)
    step[box_] += 0.5 * (last_.box.pull[c] + now.box.pull[c]) * (now.edges[c] - last_.edges[c]);
  const bool anchored = constraints_->anchors().active() && net_->anchors_total > 0;
  for (std::size_t c = 0; c < d && anchored; ++c) step[pulled_] += 0.5 * (last_.pull[c] + now.pull[c]) * (now.shift[c] - last_.shift[c]);
  if (loads_) step[grown_] += 0.5 * (last_.load_energy + now.load_energy) * (now.load - last_.load);
  if (forces_ && grown_ < step.size()) step[grown_] += work_of_forces(now);
  PetscCall(sum_over_ranks(net_->comm, step.data(), step.size()));
  for (std::size_t k = 0; k < step.size(); ++k) {
    work_[k] += step[k];
    path_ += std::abs(step[k]);
  }
  last_ = std::move(now);
  PetscFunctionReturn(0);
}

std::vector<double> Reactions::of_holders(double t, const LocalState& state) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  std::vector<double> force(constraints_->holders().size() * d), reaction(force.size(), 0.0);
  for (const Term* term : *terms_) term->forces_on(constraints_->holders(), t, state, force.data());
  constraints_->for_held([&](std::size_t k, int c) { reaction[k * d + c] = -force[k * d + c]; });
  for (const Constraints::Hold& hold : constraints_->holds()) {
    if (hold.particle >= net_->n) break;
    double x[3] = {0, 0, 0}, v[3] = {0, 0, 0}, a[3] = {0, 0, 0};
    constraints_->at(hold, t, x, v, a);
    const std::size_t row = row_of(hold.particle);
    for (std::size_t c = 0; c < d; ++c) reaction[row * d + c] += net_->inertia[hold.particle] * a[c];
  }
  return reaction;
}

PetscErrorCode Reactions::observe(double t, const LocalState& state, std::vector<Observable>* out) {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  PetscFunctionBegin;
  std::vector<double> sums(groups_.size() * d, 0.0);
  if (reports()) {
    const std::vector<double> reaction = of_holders(t, state);
    for (std::size_t g = 0; g < groups_.size(); ++g)
      for (const std::size_t row : groups_[g].rows)
        for (std::size_t c = 0; c < d; ++c) sums[g * d + c] += reaction[row * d + c];
    PetscCall(sum_over_ranks(net_->comm, sums.data(), sums.size()));
  }
  // The sum stands above the groups: readers of H5MD that take every member of /observables for a value find one.
  if (!groups_.empty()) {
    std::vector<double> sum(d, 0.0);
    for (std::size_t k = 0; k < sums.size(); ++k) sum[k % d] += sums[k];
    out->push_back({"reaction", std::move(sum)});
  }
  if (!names_.empty()) out->push_back({"work", {total()}});
  for (std::size_t g = 0; g < groups_.size(); ++g)
    out->push_back({"reaction/" + groups_[g].name,
                    std::vector<double>(sums.begin() + static_cast<std::ptrdiff_t>(g * d), sums.begin() + static_cast<std::ptrdiff_t>((g + 1) * d))});
  for (std::size_t k = 0; k < names_.size(); ++k) out->push_back({"work/" + names_[k], {work_[k]}});
  PetscFunctionReturn(0);
}

double Reactions::total() const { return std::accumulate(work_.begin(), work_.end(), 0.0); }

void Reactions::keep(const Keeper& keep) {
  for (std::size_t k = 0; k < names_.size(); ++k) keep("work_" + names_[k], work_[k]);
  if (works()) keep("path_of_work", path_);
  if (keep.restores()) begun_ = false;
}

}  // namespace bs
