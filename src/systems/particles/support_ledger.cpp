#include "systems/particles/support_ledger.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bs {

PetscErrorCode SupportLedger::create(const Network& net, const Supports& supports, const Terms& terms, const Motion& anchors, const Cell& cell) {
  PetscFunctionBegin;
  net_ = &net;
  supports_ = &supports;
  terms_ = &terms;
  anchors_ = &anchors;
  if (!net.groups.empty())
    for (PetscInt i = 0; i < net.n; ++i)
      if (const std::uint8_t mask = supports.mask(i)) {
        which_.push_back(i);
        mask_.push_back(mask);
      }
  for (const NetworkGroup& group : net.groups) {
    GroupRows rows{group.name, {}};
    for (const PetscInt i : group.member) {
      const auto at = std::lower_bound(which_.begin(), which_.end(), i);
      if (at != which_.end() && *at == i) rows.rows.push_back(static_cast<std::size_t>(at - which_.begin()));
    }
    int some = !rows.rows.empty();
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &some, 1, MPI_INT, MPI_MAX, net.comm));
    if (some) groups_.push_back(std::move(rows));
  }
  for (const Supports::Moved& one : supports.motions()) {
    place_.push_back(one.drive.moving() ? static_cast<int>(names_.size()) : -1);
    if (one.drive.moving()) names_.push_back(net.groups[one.group].name);
  }
  for (std::size_t k = 0; k < supports.holds().size(); ++k) {
    const Supports::Hold& hold = supports.holds()[k];
    if (hold.particle >= net.n || place_[static_cast<std::size_t>(hold.motion)] < 0) continue;
    moved_.push_back(k);
    row_.push_back(static_cast<std::size_t>(std::lower_bound(which_.begin(), which_.end(), hold.particle) - which_.begin()));
  }
  if (cell.moving()) {
    cell_ = &cell;
    box_ = names_.size();
    names_.emplace_back("box");
  }
  pulled_ = names_.size();
  if (anchors.active() && net.anchors_total > 0) names_.emplace_back("anchors");
  work_.assign(names_.size(), 0.0);
  PetscFunctionReturn(0);
}

void SupportLedger::count_loads(const ParticleLaws& laws) {
  if (loads_ || !(std::get<UniformGravity>(laws).active() || std::get<CentralGravity>(laws).active())) return;
  loads_ = &laws;
  grown_ = names_.size();
  names_.emplace_back("loads");
  work_.push_back(0.0);
}

namespace {

/// G: the energy of gravity under the full loads, of the particles whose energies count.
template <int d>
double full_load_energy(const Network& net, const ParticleLaws& laws, const LocalState& state) {
  UniformGravity uniform = std::get<UniformGravity>(laws);
  CentralGravity central = std::get<CentralGravity>(laws);
  uniform.load = central.load = 1;
  double sum = 0;
  for (PetscInt i = 0; i < net.n; ++i) {
    if (net.fixed[i] == 1) continue;
    const double* y = state.at(i);
    const Point<d> point{0, net.mass[i], net.columns(i), y, y + d};
    if (uniform.active()) sum += uniform.energy<d>(point);
    if (central.active()) sum += central.energy<d>(point);
  }
  return sum;
}

}  // namespace

void SupportLedger::measure(double t, const LocalState& state, Moment* out) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  out->force.resize(which_.size() * d);
  terms_->forces_on(which_, t, state, out->force.data());
  out->x.resize(moved_.size() * d);
  out->v.resize(out->x.size());
  for (std::size_t k = 0; k < moved_.size(); ++k)
    supports_->at(supports_->holds()[moved_[k]], t, out->x.data() + k * d, out->v.data() + k * d, nullptr);
  double rate[3];
  anchors_->at(t, out->shift, rate);
  std::fill_n(out->pull, 3, 0.0);
  if (anchors_->active()) terms_->pairs().pull(t, state, out->pull);
  if (loads_) {
    out->load = std::get<UniformGravity>(*loads_).load;
    out->load_energy = (net_->dim == 1 ? full_load_energy<1> : net_->dim == 2 ? full_load_energy<2> : full_load_energy<3>)(*net_, *loads_, state);
  }
  if (!cell_) return;
  out->box = {};
  terms_->box_forces(state, &out->box);
  cell_->edges(t, out->edges, nullptr);
}

void SupportLedger::begin(double t, const LocalState& state) {
  if (!works() || begun_) return;
  measure(t, state, &last_);
  begun_ = true;
}

void SupportLedger::renew(double t, const LocalState& state) {
  if (works() && begun_) measure(t, state, &last_);
}

PetscErrorCode SupportLedger::advance(double t, const LocalState& state) {
  Moment now;
  std::vector<double> step(work_.size(), 0.0);
  PetscFunctionBegin;
  if (!works() || !begun_) PetscFunctionReturn(0);
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  measure(t, state, &now);
  for (std::size_t k = 0; k < moved_.size(); ++k) {
    const Supports::Hold& hold = supports_->holds()[moved_[k]];
    double& work = step[static_cast<std::size_t>(place_[static_cast<std::size_t>(hold.motion)])];
    for (std::size_t c = 0; c < d; ++c) {
      if (!(hold.mask >> c & 1)) continue;
      const std::size_t f = row_[k] * d + c, at = k * d + c;
      work -= 0.5 * (last_.force[f] + now.force[f]) * (now.x[at] - last_.x[at]);
      work += 0.5 * net_->mass[hold.particle] * (now.v[at] - last_.v[at]) * (now.v[at] + last_.v[at]);
    }
  }
  for (std::size_t c = 0; c < d * d && cell_; ++c) step[box_] += 0.5 * (last_.box.pull[c] + now.box.pull[c]) * (now.edges[c] - last_.edges[c]);
  const bool anchored = anchors_->active() && net_->anchors_total > 0;
  for (std::size_t c = 0; c < d && anchored; ++c) step[pulled_] += 0.5 * (last_.pull[c] + now.pull[c]) * (now.shift[c] - last_.shift[c]);
  if (loads_) step[grown_] += 0.5 * (last_.load_energy + now.load_energy) * (now.load - last_.load);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, step.data(), static_cast<PetscMPIInt>(step.size()), MPI_DOUBLE, MPI_SUM, net_->comm));
  for (std::size_t k = 0; k < step.size(); ++k) {
    work_[k] += step[k];
    path_ += std::abs(step[k]);
  }
  last_ = std::move(now);
  PetscFunctionReturn(0);
}

PetscErrorCode SupportLedger::observe(double t, const LocalState& state, std::vector<Observable>* out) {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  PetscFunctionBegin;
  std::vector<double> force(which_.size() * d), sums(groups_.size() * d, 0.0);
  if (reports()) {
    terms_->forces_on(which_, t, state, force.data());
    for (double& f : force) f = -f;
    for (const Supports::Hold& hold : supports_->holds()) {
      if (hold.particle >= net_->n) break;
      double x[3] = {0, 0, 0}, v[3] = {0, 0, 0}, a[3] = {0, 0, 0};
      supports_->at(hold, t, x, v, a);
      const auto row = static_cast<std::size_t>(std::lower_bound(which_.begin(), which_.end(), hold.particle) - which_.begin());
      for (std::size_t c = 0; c < d; ++c) force[row * d + c] += net_->mass[hold.particle] * a[c];
    }
    for (std::size_t g = 0; g < groups_.size(); ++g)
      for (const std::size_t row : groups_[g].rows)
        for (std::size_t c = 0; c < d; ++c)
          if (mask_[row] >> c & 1) sums[g * d + c] += force[row * d + c];
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<PetscMPIInt>(sums.size()), MPI_DOUBLE, MPI_SUM, net_->comm));
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

double SupportLedger::total() const { return std::accumulate(work_.begin(), work_.end(), 0.0); }

void SupportLedger::save(std::map<std::string, double>* sums) const {
  for (std::size_t k = 0; k < names_.size(); ++k) (*sums)["work_" + names_[k]] = work_[k];
  if (works()) (*sums)["path_of_work"] = path_;
}

void SupportLedger::restore(const std::map<std::string, double>& sums) {
  for (std::size_t k = 0; k < names_.size(); ++k) {
    const auto at = sums.find("work_" + names_[k]);
    work_[k] = at == sums.end() ? 0 : at->second;
  }
  const auto path = sums.find("path_of_work");
  path_ = path == sums.end() ? 0 : path->second;
  begun_ = false;
}

}  // namespace bs
