#include "systems/particles/callback_forces.hpp"
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include <limits>
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

}  // namespace

void CallbackForces::create(const Network& net, const RowPattern& pattern) {
  net_ = &net;
  pattern_ = &pattern;
  callback_ = held_by<ForceCallback>(net.comm);
  if (!active()) return;
  for (PetscInt i = 0; i < net.n; ++i) {
    if (!net.fixed[static_cast<std::size_t>(i)]) free_[net.boundary(i)].push_back(i);
    if (net.fixed[static_cast<std::size_t>(i)] != 1) moving_.push_back(i);
  }
  const auto by_row = [&](PetscInt a, PetscInt b) { return net.row[static_cast<std::size_t>(a)] < net.row[static_cast<std::size_t>(b)]; };
  for (std::vector<PetscInt>* some : {&free_[0], &free_[1], &moving_}) std::sort(some->begin(), some->end(), by_row);
  all_ = free_[0];
  all_.insert(all_.end(), free_[1].begin(), free_[1].end());
  std::sort(all_.begin(), all_.end(), by_row);
  place_.assign(static_cast<std::size_t>(net.n), -1);
  for (std::size_t k = 0; k < all_.size(); ++k) place_[static_cast<std::size_t>(all_[k])] = static_cast<PetscInt>(k);
}

CallbackForces::Points CallbackForces::points(const std::vector<PetscInt>& which, const LocalState& state) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  Points points;
  for (const PetscInt i : which) {
    const double* const at = state.at(i);
    points.row.push_back(net_->row[static_cast<std::size_t>(i)]);
    points.x.insert(points.x.end(), at, at + d);
    points.v.insert(points.v.end(), at + d, at + 2 * d);
  }
  return points;
}

/// Forces, (which, d).
std::vector<double> CallbackForces::evaluate(const std::vector<PetscInt>& which, double t, const LocalState& state) const {
  const Points at = points(which, state);
  std::vector<double> f(at.x.size(), 0.0);
  if (!which.empty()) callback_.force(t, at.row, at.x.data(), at.v.data(), f.data());
  return f;
}

/// Asked for once for a state, however many products follow.
const CallbackForces::Tangents& CallbackForces::tangents(double t, const LocalState& state) const {
  Points at = points(all_, state);
  Tangents& last = tangents_;
  if (last.known && last.t == t && last.at.x == at.x && last.at.v == at.v) return last;
  const std::size_t area = static_cast<std::size_t>(net_->dim * net_->dim);
  last.known = true;
  last.t = t;
  last.at = std::move(at);
  last.K.assign(all_.size() * area, 0.0);
  last.D.assign(all_.size() * area, 0.0);
  if (!all_.empty()) callback_.tangent(t, last.at.row, last.at.x.data(), last.at.v.data(), last.K.data(), last.D.data());
  return last;
}

void CallbackForces::forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const {
  const std::vector<PetscInt>& which = free_[static_cast<int>(part)];
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double> some = evaluate(which, t, state);
  for (std::size_t k = 0; k < which.size(); ++k)
    for (std::size_t c = 0; c < d; ++c) {
      const std::size_t i = static_cast<std::size_t>(which[k]);
      f[i * d + c] += some[k * d + c];
      if (!std::isfinite(some[k * d + c]) && fault->kind == Singularity::none) *fault = {Singularity::outside, net_->row[i]};
    }
  if (sum && part == Part::boundary) energies(t, state, sum);
}

void CallbackForces::forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const {
  const std::vector<double> some = evaluate(which, t, state);
  for (std::size_t k = 0; k < some.size(); ++k) f[k] += some[k];
}

void CallbackForces::energies(double t, const LocalState& state, Energies* sum) const {
  if (!callback_.energy || moving_.empty()) return;
  const Points at = points(moving_, state);
  std::vector<double> E(moving_.size(), 0.0);
  callback_.energy(t, at.row, at.x.data(), E.data());
  for (const double one : E) sum->field += one;
}

// sigma (E(x + lambda dx) - E(x) + f . lambda dx): a difference, whose rounding errors are those of the energies
void CallbackForces::beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma,
                                  PotentialChange* sum) const {
  if (!callback_.energy || all_.empty()) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  Points at = points(all_, state);
  std::vector<double> before(all_.size(), 0.0), after(all_.size(), 0.0);
  const std::vector<double> f = evaluate(all_, t, state);
  callback_.energy(t, at.row, at.x.data(), before.data());
  double change = 0, size = 0;
  for (std::size_t k = 0; k < all_.size(); ++k)
    for (std::size_t c = 0; c < d; ++c) {
      const double step = lambda * line.at(all_[k])[c];
      change += f[k * d + c] * step;
      size += std::abs(f[k * d + c] * step);
      at.x[k * d + c] += step;
    }
  callback_.energy(t, at.row, at.x.data(), after.data());
  for (std::size_t k = 0; k < all_.size(); ++k) {
    change += after[k] - before[k];
    size += std::abs(after[k]) + std::abs(before[k]);
  }
  sum->value += sigma * change;
  sum->noise += sigma * std::numeric_limits<double>::epsilon() * size;
}

void CallbackForces::supply(double t, const LocalState& state, Supply* sum) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double> some = evaluate(moving_, t, state);
  for (std::size_t k = 0; k < moving_.size(); ++k)
    for (std::size_t c = 0; c < d; ++c) {
      const double power = some[k * d + c] * state.at(moving_[k])[d + c];
      if (callback_.energy) sum->field += power;
      else sum->coupling += std::abs(power);
    }
}

void CallbackForces::outer_sizes(double t, const LocalState& state, double* size) const {
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const std::vector<double> some = evaluate(all_, t, state);
  for (std::size_t k = 0; k < all_.size(); ++k) {
    double square = 0;
    for (std::size_t c = 0; c < d; ++c) square += some[k * d + c] * some[k * d + c];
    size[all_[k]] += std::sqrt(square);
  }
}

void CallbackForces::multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const {
  if (!callback_.tangent) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  const Tangents& own = tangents(t, state);
  for (std::size_t k = 0; k < all_.size(); ++k) {
    const std::size_t i = static_cast<std::size_t>(all_[k]);
    const double *K = &own.K[k * d * d], *D = &own.D[k * d * d], *zi = z.at(all_[k]);
    for (std::size_t r = 0; r < d; ++r)
      for (std::size_t c = 0; c < d; ++c) f[i * d + r] += K[r * d + c] * zi[c] + D[r * d + c] * zi[d + c];
  }
}

void CallbackForces::add_row(PetscInt i, double t, const LocalState& state, double* panel, PetscInt width) const {
  if (!callback_.tangent || place_[static_cast<std::size_t>(i)] < 0) return;
  const Tangents& own = tangents(t, state);
  const PetscInt d = net_->dim, area = d * d, k = place_[static_cast<std::size_t>(i)];
  for (PetscInt r = 0; r < d; ++r)
    for (PetscInt c = 0; c < d; ++c) {
      double* const to = panel + r * width + pattern_->self(i) * 2 * d + c;
      to[0] -= own.K[static_cast<std::size_t>(k * area + r * d + c)];
      to[d] -= own.D[static_cast<std::size_t>(k * area + r * d + c)];
    }
}

void CallbackForces::join(std::vector<std::pair<PetscInt, PetscInt>>* joins) const {
  if (!callback_.tangent) return;
  for (const PetscInt i : all_) joins->emplace_back(i, i);
}

void CallbackForces::add_blocks(double t, const LocalState& state, bool positive, const Coefficients& abc, SparseBlocks* blocks) const {
  if (!callback_.tangent) return;
  const Tangents& own = tangents(t, state);
  const int d = net_->dim, area = d * d;
  for (std::size_t k = 0; k < all_.size(); ++k) {
    double block[9];
    const double *K = &own.K[k * static_cast<std::size_t>(area)], *D = &own.D[k * static_cast<std::size_t>(area)];
    for (int r = 0; r < d; ++r)
      for (int c = 0; c < d; ++c)
        block[r * d + c] = -0.5 * (abc.damping * (D[r * d + c] + D[c * d + r]) + abc.stiffness * (K[r * d + c] + K[c * d + r]));
    if (positive && !keep_definite(d, block)) continue;
    double* const to = blocks->block(blocks->find(all_[k], all_[k]));
    for (int q = 0; q < area; ++q) to[q] += block[q];
  }
}

void CallbackForces::stiffness_sizes(double t, const LocalState& state, double* size) const {
  if (!callback_.tangent) return;
  const Tangents& own = tangents(t, state);
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (std::size_t k = 0; k < all_.size(); ++k)
    for (std::size_t c = 0; c < d; ++c) size[all_[k]] += std::abs(own.K[k * d * d + c * (d + 1)]);
}

}  // namespace bs
