#include "systems/particles/callback_forces.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include "base/context.hpp"

namespace bs {

std::vector<std::array<std::int64_t, 2>> couples_of(const ForceCallback& callback) {
  ForceCallback::Pairs all;
  for (const auto& [i, j] : callback.between) all.insert(all.end(), {{i, j}, {j, i}});
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

void CallbackForces::create(const Network& net, const RowPattern& pattern) {
  net_ = &net;
  pattern_ = &pattern;
  callback_ = held_by<ForceCallback>(net.comm);
  if (!active()) return;
  couple();
  const bool between = !callback_.between.empty();
  for (const PetscInt i : asked_) {
    if (i >= net.n) continue;
    const auto at = static_cast<std::size_t>(i);
    if (!net.fixed[at]) {
      free_.push_back(i);
      of_part_[net.boundary(i)].push_back(i);
    }
    if (net.fixed[at] != 1) moving_.push_back(i);
    if (between || net.fixed[at] != 1) counted_.push_back(i);
    if (between || !net.fixed[at]) changed_.push_back(i);
  }
}

/// Finds the particles for which the callback is asked, and the pairs between them. There are pairs outside periodic boxes only, so that ghosts are
/// particles of other ranks, not images.
void CallbackForces::couple() {
  const Network& net = *net_;
  std::vector<std::pair<std::int64_t, PetscInt>> local;
  for (const std::int64_t row : net.local_rows()) local.emplace_back(row, static_cast<PetscInt>(local.size()));
  std::sort(local.begin(), local.end());
  const auto find = [&](std::int64_t row) {
    const auto at = std::lower_bound(local.begin(), local.end(), std::make_pair(row, PetscInt(0)));
    return at != local.end() && at->first == row ? at->second : PetscInt(-1);
  };
  std::vector<std::pair<PetscInt, PetscInt>> pairs;
  std::vector<std::uint8_t> wanted(static_cast<std::size_t>(net.n + net.ghosts), 0);
  std::fill_n(wanted.begin(), net.n, 1);
  for (const auto& [a, b] : callback_.between) {
    const PetscInt i = find(a), j = find(b);
    if (i < 0 || j < 0 || (i >= net.n && j >= net.n)) continue;
    pairs.emplace_back(i, j);
    wanted[static_cast<std::size_t>(i)] = wanted[static_cast<std::size_t>(j)] = 1;
  }
  place_.assign(wanted.size(), NONE);
  for (const auto& [row, i] : local) {
    if (!wanted[static_cast<std::size_t>(i)]) continue;
    place_[static_cast<std::size_t>(i)] = asked_.size();
    asked_.push_back(i);
    rows_.push_back(row);
  }
  find_influences(pairs);
}

/// Finds those pairs (i, j) of local particles for which the tangent has blocks.
void CallbackForces::find_influences(const std::vector<std::pair<PetscInt, PetscInt>>& pairs) {
  const Links& links = net_->links;
  std::map<std::pair<PetscInt, PetscInt>, std::size_t> number;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    number.emplace(pairs[k], k);
    pairs_.push_back({static_cast<std::int64_t>(place(pairs[k].first)), static_cast<std::int64_t>(place(pairs[k].second))});
  }
  const auto found = [&](PetscInt i, PetscInt j) {
    const auto at = number.find({i, j});
    return at == number.end() ? NONE : at->second;
  };
  // S is symmetric: it has both blocks of a pair even where only one of (i, j) and (j, i) is given
  for (const auto& [a, b] : pairs)
    for (const auto& [i, j] : {std::make_pair(a, b), std::make_pair(b, a)}) {
      if (i >= net_->n || net_->fixed[static_cast<std::size_t>(i)] || net_->fixed[static_cast<std::size_t>(j)]) continue;
      if (std::make_pair(i, j) != std::make_pair(a, b) && found(i, j) != NONE) continue;
      PetscInt link = links.start[i];
      while (links.other[link] != j) ++link;
      felt_.push_back({i, j, link, found(i, j), found(j, i)});
    }
  std::sort(felt_.begin(), felt_.end(), [](const Influence& a, const Influence& b) { return a.i < b.i; });
}

bool CallbackForces::all_finite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double one) { return std::isfinite(one); });
}

/// Sets the time, positions and velocities of `asked` to those of this state. Returns false where they were the same already.
bool CallbackForces::move_to(double t, const LocalState& state, Evaluation* asked) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  bool same = asked->known && asked->t == t;
  asked->x.resize(asked_.size() * d);
  asked->v.resize(asked_.size() * d);
  for (std::size_t k = 0; k < asked_.size(); ++k) {
    const double* const at = state.at(asked_[k]);
    same = same && std::equal(at, at + d, &asked->x[k * d]) && std::equal(&asked->v[k * d], &asked->v[k * d] + d, at + d);
    std::copy_n(at, d, &asked->x[k * d]);
    std::copy_n(at + d, d, &asked->v[k * d]);
  }
  asked->t = t;
  asked->known = true;
  return !same;
}

/// The callback's forces on the particles asked for, (asked, d). It is called once for a state, however many callers need them.
const std::vector<double>& CallbackForces::own_forces(double t, const LocalState& state) const {
  if (!move_to(t, state, &forces_)) return forces_.f;
  forces_.f.assign(forces_.x.size(), 0.0);
  if (!asked_.empty()) callback_.force(t, rows_, forces_.x.data(), forces_.v.data(), forces_.f.data());
  forces_.known = all_finite(forces_.f);
  return forces_.f;
}

PetscErrorCode CallbackForces::begin_step(const Step& step, const LocalState& state) {
  PetscFunctionBegin;
  (void)move_to(step.t, state, &forces_);
  if (callback_.begin_step) callback_.begin_step(step.t, step.h, step.number, step.attempt, rows_, forces_.x.data(), forces_.v.data());
  forces_.known = tangents_.known = false;
  PetscFunctionReturn(0);
}

/// The callback's energies (asked) at the positions x, (asked, d).
std::vector<double> CallbackForces::energies_at(double t, const std::vector<double>& x) const {
  std::vector<double> E(asked_.size(), 0.0);
  if (!asked_.empty()) callback_.energy(t, rows_, x.data(), E.data());
  return E;
}

void CallbackForces::forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const {
  const std::vector<PetscInt>& which = of_part_[static_cast<int>(part)];
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  if (!which.empty()) {
    const std::vector<double>& own = own_forces(t, state);
    for (const PetscInt i : which)
      for (std::size_t c = 0; c < d; ++c) {
        const double one = own[place(i) * d + c];
        f[static_cast<std::size_t>(i) * d + c] += one;
        if (!std::isfinite(one) && fault->kind == Singularity::none) *fault = {Singularity::outside, net_->row[static_cast<std::size_t>(i)]};
      }
  }
  if (sum && part == Part::boundary) energies(t, state, sum);
}

void CallbackForces::forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const {
  if (which.empty()) return;
  const std::vector<double>& own = own_forces(t, state);
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (std::size_t k = 0; k < which.size(); ++k)
    for (std::size_t c = 0; c < d; ++c) f[k * d + c] += own[place(which[k]) * d + c];
}

void CallbackForces::energies(double t, const LocalState& state, Energies* sum) const {
  if (!callback_.energy || counted_.empty()) return;
  Evaluation at;
  move_to(t, state, &at);
  const std::vector<double> E = energies_at(t, at.x);
  for (const PetscInt i : counted_) sum->field += E[place(i)];
}

// sigma (E(x + lambda dx) - E(x) + f . lambda dx): a difference, whose rounding errors are those of the energies
void CallbackForces::beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma,
                                  PotentialChange* sum) const {
  if (!callback_.energy || changed_.empty()) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double>& f = own_forces(t, state);
  std::vector<double> x = forces_.x;
  const std::vector<double> before = energies_at(t, x);
  double change = 0, size = 0;
  for (const PetscInt i : asked_)
    for (std::size_t c = 0; c < d && !net_->fixed[static_cast<std::size_t>(i)]; ++c) {
      const std::size_t at = place(i) * d + c;
      const double step = lambda * line.at(i)[c];
      x[at] += step;
      if (i >= net_->n) continue;
      change += f[at] * step;
      size += std::abs(f[at] * step);
    }
  const std::vector<double> after = energies_at(t, x);
  for (const PetscInt i : changed_) {
    change += after[place(i)] - before[place(i)];
    size += std::abs(after[place(i)]) + std::abs(before[place(i)]);
  }
  sum->value += sigma * change;
  sum->noise += sigma * std::numeric_limits<double>::epsilon() * size;
}

double CallbackForces::largest_lambda(double t, const LocalState& state, const LocalState& line) const {
  if (asked_.empty()) return std::numeric_limits<double>::infinity();
  Evaluation at, along;
  move_to(t, state, &at);
  move_to(t, line, &along);
  for (std::size_t k = 0; k < asked_.size(); ++k)
    if (net_->fixed[static_cast<std::size_t>(asked_[k])]) std::fill_n(&along.x[k * static_cast<std::size_t>(net_->dim)], net_->dim, 0.0);
  return callback_.limit(t, rows_, at.x.data(), along.x.data());
}

void CallbackForces::supply(double t, const LocalState& state, Supply* sum) const {
  if (moving_.empty()) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double>& own = own_forces(t, state);
  for (const PetscInt i : moving_)
    for (std::size_t c = 0; c < d; ++c) {
      const double power = own[place(i) * d + c] * state.at(i)[d + c];
      if (callback_.energy) sum->field += power;
      else sum->coupling += std::abs(power);
    }
}

void CallbackForces::outer_sizes(double t, const LocalState& state, double* size) const {
  if (free_.empty()) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double>& own = own_forces(t, state);
  for (const PetscInt i : free_) {
    double square = 0;
    for (std::size_t c = 0; c < d; ++c) square += own[place(i) * d + c] * own[place(i) * d + c];
    size[i] += std::sqrt(square);
  }
}

}  // namespace bs
