// What forces that a program on the library computes change by with places and velocities.
#include <petscblaslapack.h>
#include <algorithm>
#include <cmath>
#include "systems/layout.hpp"
#include "systems/particles/callback_forces.hpp"

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

/// to += B z_x + C z_v for d x d blocks and a state z.
void add_product(std::size_t d, const double* B, const double* C, const double* z, double* to) {
  for (std::size_t r = 0; r < d; ++r)
    for (std::size_t c = 0; c < d; ++c) to[r] += B[r * d + c] * z[c] + C[r * d + c] * z[d + c];
}

/// Blocks of -df/dx and -df/dv at a place of a panel.
void subtract(PetscInt d, const double* B, const double* C, PetscInt width, double* to) {
  for (PetscInt r = 0; r < d; ++r)
    for (PetscInt c = 0; c < d; ++c) {
      to[r * width + c] -= B[r * d + c];
      to[r * width + d + c] -= C[r * d + c];
    }
}

}  // namespace

/// The callback is called once for a state, however many products follow.
const CallbackForces::Evaluation& CallbackForces::tangents(double t, const LocalState& state) const {
  if (!move_to(t, state, &tangents_)) return tangents_;
  const std::size_t area = static_cast<std::size_t>(net_->dim * net_->dim);
  tangents_.K.assign(asked_.size() * area, 0.0);
  tangents_.D = tangents_.K;
  tangents_.K_between.assign(pairs_.size() * area, 0.0);
  tangents_.D_between = tangents_.K_between;
  if (!asked_.empty())
    callback_.tangent(t, rows_, pairs_, tangents_.x.data(), tangents_.v.data(),
                      {tangents_.K.data(), tangents_.D.data(), tangents_.K_between.data(), tangents_.D_between.data()});
  tangents_.known = all_finite(tangents_.K) && all_finite(tangents_.D) && all_finite(tangents_.K_between) && all_finite(tangents_.D_between);
  return tangents_;
}

std::pair<const CallbackForces::Influence*, const CallbackForces::Influence*> CallbackForces::influences_on(PetscInt i) const {
  const auto [first, last] =
      std::equal_range(felt_.begin(), felt_.end(), Influence{i, 0, 0, 0, 0}, [](const Influence& a, const Influence& b) { return a.i < b.i; });
  return {felt_.data() + (first - felt_.begin()), felt_.data() + (last - felt_.begin())};
}

void CallbackForces::multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const {
  if (!callback_.tangent || free_.empty()) return;
  const std::size_t d = static_cast<std::size_t>(net_->dim), area = d * d;
  const Evaluation& own = tangents(t, state);
  for (const PetscInt i : free_) add_product(d, &own.K[place(i) * area], &own.D[place(i) * area], z.at(i), f + static_cast<std::size_t>(i) * d);
  for (const Influence& one : felt_)
    if (one.pair != NONE)
      add_product(d, &own.K_between[one.pair * area], &own.D_between[one.pair * area], z.at(one.j), f + static_cast<std::size_t>(one.i) * d);
}

void CallbackForces::add_row(PetscInt i, double t, const LocalState& state, double* panel, PetscInt width) const {
  if (!callback_.tangent || net_->fixed[static_cast<std::size_t>(i)]) return;
  const Evaluation& own = tangents(t, state);
  const PetscInt d = net_->dim;
  const Layout at{d};
  const std::size_t area = static_cast<std::size_t>(d * d);
  subtract(d, &own.K[place(i) * area], &own.D[place(i) * area], width, panel + at.x(pattern_->self(i)));
  const auto [first, last] = influences_on(i);
  for (const Influence* one = first; one != last; ++one)
    if (one->pair != NONE)
      subtract(d, &own.K_between[one->pair * area], &own.D_between[one->pair * area], width, panel + at.x(pattern_->slot(one->link)));
}

void CallbackForces::join(std::vector<std::pair<PetscInt, PetscInt>>* joins) const {
  if (!callback_.tangent) return;
  for (const PetscInt i : free_) joins->emplace_back(i, i);
  for (const Influence& one : felt_) joins->emplace_back(one.i, one.j);
}

// The definite part is that of each particle's own block, which bears those between particles where they come from a potential that holds them.
void CallbackForces::add_blocks(double t, const LocalState& state, bool positive, const Coefficients& abc, SparseBlocks* blocks) const {
  if (!callback_.tangent || free_.empty()) return;
  const Evaluation& own = tangents(t, state);
  const std::size_t d = static_cast<std::size_t>(net_->dim), area = d * d;
  const auto half = [&](const std::vector<double>& K, const std::vector<double>& D, std::size_t block, std::size_t entry) {
    return block == NONE ? 0.0 : -0.5 * (abc.damping * D[block * area + entry] + abc.stiffness * K[block * area + entry]);
  };
  for (const PetscInt i : free_) {
    double block[9];
    for (std::size_t r = 0; r < d; ++r)
      for (std::size_t c = 0; c < d; ++c) block[r * d + c] = half(own.K, own.D, place(i), r * d + c) + half(own.K, own.D, place(i), c * d + r);
    if (positive && !keep_definite(static_cast<PetscBLASInt>(d), block)) continue;
    double* const to = blocks->block(blocks->find(i, i));
    for (std::size_t q = 0; q < area; ++q) to[q] += block[q];
  }
  for (const Influence& one : felt_) {
    if (positive) break;
    double* const to = blocks->block(blocks->find(one.i, one.j));
    for (std::size_t r = 0; r < d; ++r)
      for (std::size_t c = 0; c < d; ++c)
        to[r * d + c] += half(own.K_between, own.D_between, one.pair, r * d + c) + half(own.K_between, own.D_between, one.back, c * d + r);
  }
}

void CallbackForces::stiffness_sizes(double t, const LocalState& state, double* size) const {
  if (!callback_.tangent || free_.empty()) return;
  const Evaluation& own = tangents(t, state);
  const std::size_t d = static_cast<std::size_t>(net_->dim);
  for (const PetscInt i : free_)
    for (std::size_t c = 0; c < d; ++c) size[i] += std::abs(own.K[place(i) * d * d + c * (d + 1)]);
}

}  // namespace bs
