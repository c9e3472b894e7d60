#include "systems/particles/callback_forces.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include "base/context.hpp"

namespace bs {

namespace {

/// Of a symmetric (d, d) block, what eigenvalues of at least 0 make. False: LAPACK failed.
bool keep_definite(PetscBLASInt d, double* block) {
  double vectors[9], values[3], room[64];
  PetscBLASInt size = 64, info = 0;
  std::copy_n(block, d * d, vectors);
  LAPACKsyev_("V", "U", &d, vectors, &d, values, room, &size, &info);
  if (info != 0) return false;
  if (values[0] >= 0) return true;
  std::fill_n(block, d * d, 0.0);
  for (PetscBLASInt k = 0; k < d; ++k)
    for (PetscBLASInt r = 0; r < d && values[k] > 0; ++r)
      for (PetscBLASInt c = 0; c < d; ++c) block[r * d + c] += values[k] * vectors[k * d + r] * vectors[k * d + c];
  return true;
}

/// An exception in a callback leaves numbers that are not finite: they are asked for again.
bool all_finite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double one) { return std::isfinite(one); });
}

}  // namespace

void CallbackForces::create(const Network& net, const RowPattern& pattern) {
  net_ = &net;
  pattern_ = &pattern;
  callback_ = held_by<ForceCallback>(net.comm);
  if (!active()) return;
  own_.resize(static_cast<std::size_t>(net.n));
  std::iota(own_.begin(), own_.end(), 0);
  std::sort(own_.begin(), own_.end(),
            [&](PetscInt a, PetscInt b) { return net.row[static_cast<std::size_t>(a)] < net.row[static_cast<std::size_t>(b)]; });
  place_.resize(own_.size());
  for (std::size_t k = 0; k < own_.size(); ++k) {
    const auto i = static_cast<std::size_t>(own_[k]);
    place_[i] = k;
    rows_.push_back(net.row[i]);
    if (!net.fixed[i]) {
      free_.push_back(own_[k]);
      of_part_[net.boundary(own_[k])].push_back(own_[k]);
    }
    if (net.fixed[i] != 1) moving_.push_back(own_[k]);
  }
}

/// `asked` is of the own particles at this state from now on; false: it was before.
bool CallbackForces::move_to(double t, const LocalState& state, Asked* asked) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  bool same = asked->known && asked->t == t;
  asked->x.resize(own_.size() * d);
  asked->v.resize(own_.size() * d);
  for (std::size_t k = 0; k < own_.size(); ++k) {
    const double* const at = state.at(own_[k]);
    same = same && std::equal(at, at + d, &asked->x[k * d]) && std::equal(at + d, at + 2 * d, &asked->v[k * d]);
    std::copy_n(at, d, &asked->x[k * d]);
    std::copy_n(at + d, d, &asked->v[k * d]);
  }
  asked->t = t;
  asked->known = true;
  return !same;
}

/// (own, d). Asked for once for a state, by however many parts.
const std::vector<double>& CallbackForces::own_forces(double t, const LocalState& state) const {
  if (!move_to(t, state, &forces_)) return forces_.f;
  forces_.f.assign(forces_.x.size(), 0.0);
  if (!own_.empty()) callback_.force(t, rows_, forces_.x.data(), forces_.v.data(), forces_.f.data());
  forces_.known = all_finite(forces_.f);
  return forces_.f;
}

/// Likewise, however many products follow.
const CallbackForces::Asked& CallbackForces::tangents(double t, const LocalState& state) const {
  if (!move_to(t, state, &tangents_)) return tangents_;
  const std::size_t area = static_cast<std::size_t>(net_->dim * net_->dim);
  tangents_.K.assign(own_.size() * area, 0.0);
  tangents_.D.assign(own_.size() * area, 0.0);
  if (!own_.empty()) callback_.tangent(t, rows_, tangents_.x.data(), tangents_.v.data(), tangents_.K.data(), tangents_.D.data());
  tangents_.known = all_finite(tangents_.K) && all_finite(tangents_.D);
  return tangents_;
}

/// (own) at the places x, (own, d).
std::vector<double> CallbackForces::own_energies(double t, const std::vector<double>& x) const {
  std::vector<double> E(own_.size(), 0.0);
  if (!own_.empty()) callback_.energy(t, rows_, x.data(), E.data());
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
  if (!callback_.energy || moving_.empty()) return;
  Asked at;
  move_to(t, state, &at);
  const std::vector<double> E = own_energies(t, at.x);
  for (const PetscInt i : moving_) sum->field += E[place(i)];
}

// sigma (E(x + lambda dx) - E(x) + f . lambda dx): a difference, whose rounding errors are those of the energies
void CallbackForces::beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma,
                                  PotentialChange* sum) const {
  if (!callback_.energy || free_.empty()) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double>& f = own_forces(t, state);
  std::vector<double> x = forces_.x;
  const std::vector<double> before = own_energies(t, x);
  double change = 0, size = 0;
  for (const PetscInt i : free_)
    for (std::size_t c = 0; c < d; ++c) {
      const std::size_t at = place(i) * d + c;
      const double step = lambda * line.at(i)[c];
      change += f[at] * step;
      size += std::abs(f[at] * step);
      x[at] += step;
    }
  const std::vector<double> after = own_energies(t, x);
  for (const PetscInt i : free_) {
    change += after[place(i)] - before[place(i)];
    size += std::abs(after[place(i)]) + std::abs(before[place(i)]);
  }
  sum->value += sigma * change;
  sum->noise += sigma * std::numeric_limits<double>::epsilon() * size;
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

void CallbackForces::multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const {
  if (!callback_.tangent || free_.empty()) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const Asked& own = tangents(t, state);
  for (const PetscInt i : free_) {
    const std::size_t k = place(i);
    const double *K = &own.K[k * d * d], *D = &own.D[k * d * d], *zi = z.at(i);
    for (std::size_t r = 0; r < d; ++r)
      for (std::size_t c = 0; c < d; ++c) f[static_cast<std::size_t>(i) * d + r] += K[r * d + c] * zi[c] + D[r * d + c] * zi[d + c];
  }
}

void CallbackForces::add_row(PetscInt i, double t, const LocalState& state, double* panel, PetscInt width) const {
  if (!callback_.tangent || net_->fixed[static_cast<std::size_t>(i)]) return;
  const Asked& own = tangents(t, state);
  const PetscInt d = net_->dim;
  const std::size_t from = place(i) * static_cast<std::size_t>(d * d);
  for (PetscInt r = 0; r < d; ++r)
    for (PetscInt c = 0; c < d; ++c) {
      double* const to = panel + r * width + pattern_->self(i) * 2 * d + c;
      to[0] -= own.K[from + static_cast<std::size_t>(r * d + c)];
      to[d] -= own.D[from + static_cast<std::size_t>(r * d + c)];
    }
}

void CallbackForces::join(std::vector<std::pair<PetscInt, PetscInt>>* joins) const {
  if (!callback_.tangent) return;
  for (const PetscInt i : free_) joins->emplace_back(i, i);
}

void CallbackForces::add_blocks(double t, const LocalState& state, bool positive, const Coefficients& abc, SparseBlocks* blocks) const {
  if (!callback_.tangent || free_.empty()) return;
  const Asked& own = tangents(t, state);
  const int d = net_->dim, area = d * d;
  for (const PetscInt i : free_) {
    double block[9];
    const std::size_t from = place(i) * static_cast<std::size_t>(area);
    const double *K = &own.K[from], *D = &own.D[from];
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c)
        block[r * d + c] = -0.5 * (abc.damping * (D[r * d + c] + D[c * d + r]) + abc.stiffness * (K[r * d + c] + K[c * d + r]));
    if (positive && !keep_definite(d, block)) continue;
    double* const to = blocks->block(blocks->find(i, i));
    for (int q = 0; q < area; ++q) to[q] += block[q];
  }
}

void CallbackForces::stiffness_sizes(double t, const LocalState& state, double* size) const {
  if (!callback_.tangent || free_.empty()) return;
  const Asked& own = tangents(t, state);
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (const PetscInt i : free_)
    for (std::size_t c = 0; c < d; ++c) size[i] += std::abs(own.K[place(i) * d * d + c * (d + 1)]);
}

}  // namespace bs
