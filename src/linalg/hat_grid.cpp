#include "linalg/hat_grid.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/dimension.hpp"
#include "linalg/lanes.hpp"
#include "linalg/pair_product.hpp"

namespace bs {

PetscErrorCode HatGrid::create(MPI_Comm comm, int dim, PetscInt n, const std::vector<double>& points, const std::vector<std::uint8_t>& fixed,
                               PetscInt nodes) {
  double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, longest = 0;

  PetscFunctionBegin;
  dim_ = dim;
  n_ = n;
  nodes_ = 0;
  for (int c = 0; c < dim; ++c) {
    low[c] = std::numeric_limits<double>::max();
    high[c] = -low[c];
    for (PetscInt i = 0; i < n; ++i) {
      low[c] = std::min(low[c], points[static_cast<std::size_t>(i * dim + c)]);
      high[c] = std::max(high[c], points[static_cast<std::size_t>(i * dim + c)]);
    }
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, low, dim, MPI_DOUBLE, MPI_MIN, comm));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, high, dim, MPI_DOUBLE, MPI_MAX, comm));
  for (int c = 0; c < dim; ++c) longest = std::max(longest, high[c] - low[c]);
  for (int cells = 1; longest > 0 && cells <= nodes; ++cells) {
    double all = 1;
    PetscInt count[3] = {1, 1, 1};
    for (int c = 0; c < dim; ++c) {
      count[c] = 1 + static_cast<PetscInt>(std::ceil((high[c] - low[c]) / longest * cells - 1e-9));
      all *= static_cast<double>(count[c]);
    }
    if (all > static_cast<double>(nodes)) break;
    nodes_ = static_cast<PetscInt>(all);
    std::copy_n(count, 3, count_);
  }
  for (int c = 0; c < dim; ++c) {
    low_[c] = low[c];
    span_[c] = high[c] - low[c];
  }
  if (nodes_ > 0) place(points, fixed);
  PetscFunctionReturn(0);
}

PetscErrorCode HatGrid::fills_space(MPI_Comm comm, bool* yes) const {
  std::vector<unsigned char> met(static_cast<std::size_t>(nodes_), 0);
  PetscInt cells = 1;
  PetscFunctionBegin;
  for (const PetscInt count : count_) cells *= count - 1;
  for (PetscInt i = 0; i < n_; ++i)
    if (cell(i) >= 0) met[static_cast<std::size_t>(cell(i))] = 1;
  PetscCall(max_over_ranks(comm, met.data(), met.size()));
  *yes = cells > 0 && 2 * std::count(met.begin(), met.end(), 1) > cells;
  PetscFunctionReturn(0);
}

void HatGrid::place(const std::vector<double>& points, const std::vector<std::uint8_t>& fixed) {
  cell_.assign(fixed.size(), -1);
  fraction_.assign(points.size(), 0.0F);
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    PetscInt at = 0, stride = 1;
    if (fixed[i]) continue;
    for (int c = 0; c < dim_; ++c) {
      const std::size_t k = i * static_cast<std::size_t>(dim_) + static_cast<std::size_t>(c);
      const double where = count_[c] > 1 ? (points[k] - low_[c]) / span_[c] * static_cast<double>(count_[c] - 1) : 0;
      const PetscInt whole = std::clamp<PetscInt>(static_cast<PetscInt>(where), 0, std::max<PetscInt>(0, count_[c] - 2));
      if (count_[c] > 1) fraction_[k] = static_cast<float>(where - static_cast<double>(whole));
      at += whole * stride;
      stride *= count_[c];
    }
    cell_[i] = static_cast<std::int32_t>(at);
  }
  particles_ = static_cast<PetscInt>(std::count(fixed.begin(), fixed.begin() + n_, 0));
}

template <int d>
void HatGrid::offsets(PetscInt* offset) const noexcept {
  PetscInt stride = 1;
  offset[0] = 0;
  for (int c = 0, made = 1; c < d; ++c, made *= 2) {
    // where the system is flat there is one layer of nodes, and the share in a second one is nothing
    for (int k = 0; k < made; ++k) offset[made + k] = offset[k] + (count_[c] > 1 ? stride : 0);
    stride *= count_[c];
  }
}

template <int d>
static void corner_shares(const float* fraction, double* share) noexcept {
  const double x = static_cast<double>(fraction[0]), y = d > 1 ? static_cast<double>(fraction[d > 1 ? 1 : 0]) : 0;
  share[0] = 1 - x;
  share[1] = x;
  for (int k = 0; k < 2 && d > 1; ++k) {
    share[2 + k] = share[k] * y;
    share[k] -= share[2 + k];
  }
  for (int k = 0; k < 4 && d > 2; ++k) {
    share[4 + k] = share[k] * static_cast<double>(fraction[d - 1]);
    share[k] -= share[4 + k];
  }
}

template <int d>
void HatGrid::shares(PetscInt i, double* share) const noexcept {
  corner_shares<d>(fraction_.data() + static_cast<std::size_t>(i) * d, share);
}

template <int d>
bool HatGrid::continued_shares(PetscInt i, PetscInt j, double* share) const noexcept {
  constexpr float FAR = 0.5F;
  const float *here = fraction_.data() + static_cast<std::size_t>(i) * d, *there = fraction_.data() + static_cast<std::size_t>(j) * d;
  float fraction[d];
  PetscInt from = cell(i), to = cell(j);
  if (from == to) {
    corner_shares<d>(there, share);
    return true;
  }
  for (int c = 0; c < d; ++c) {
    fraction[c] = there[c] + static_cast<float>(to % count_[c] - from % count_[c]);
    if (std::abs(fraction[c] - here[c]) > FAR) return false;
    from /= count_[c];
    to /= count_[c];
  }
  corner_shares<d>(fraction, share);
  return true;
}

// Neighbours in the order of points are mostly in one cell: its corners stay in registers.
template <int d>
void HatGrid::restrict_of(const double* r, double* coarse) const {
  constexpr int C = 1 << d;
  PetscInt offset[C], present = -1;
  double share[8];
  lanes::Vector<d> corner[C] = {};
  offsets<d>(offset);
  const Points<d> values(r, n_);
  lanes_.assign(static_cast<std::size_t>(nodes_) * LANES<d>, 0.0);
  const auto leave = [&] {
    for (int k = 0; k < C && present >= 0; ++k) {
      double* at = lanes_.data() + static_cast<std::size_t>(present + offset[k]) * LANES<d>;
      lanes::store<d>(lanes::load<d>(at) + corner[k], at);
      corner[k] = lanes::splat<d>(0.0);
    }
  };
  for (PetscInt i = 0; i < n_; ++i) {
    if (cell(i) < 0) continue;
    if (cell(i) != present) {
      leave();
      present = cell(i);
    }
    shares<d>(i, share);
    const lanes::Vector<d> v = values[i];
    for (int k = 0; k < C; ++k) corner[k] += lanes::splat<d>(share[k]) * v;
  }
  leave();
  for (PetscInt k = 0; k < nodes_ * d; ++k) coarse[k] = lanes_[k / d * LANES<d> + k % d];
}

template <int d>
void HatGrid::prolong_of(const double* coarse, double* z) const {
  constexpr int C = 1 << d;
  PetscInt offset[C], present = -1;
  double share[8];
  lanes::Vector<d> corner[C] = {};
  offsets<d>(offset);
  lanes_.resize(static_cast<std::size_t>(nodes_) * LANES<d>);
  for (PetscInt k = 0; k < nodes_ * d; ++k) lanes_[k / d * LANES<d> + k % d] = coarse[k];
  for (PetscInt i = 0; i < n_; ++i) {
    if (cell(i) < 0) continue;
    if (cell(i) != present) {
      present = cell(i);
      for (int k = 0; k < C; ++k) corner[k] = lanes::load<d>(lanes_.data() + static_cast<std::size_t>(present + offset[k]) * LANES<d>);
    }
    shares<d>(i, share);
    lanes::Vector<d> sum = lanes::splat<d>(0.0);
    for (int k = 0; k < C; ++k) sum += lanes::splat<d>(share[k]) * corner[k];
    for (int c = 0; c < d; ++c) z[static_cast<std::size_t>(i) * d + c] += sum[c];
  }
}

void HatGrid::restrict_to(const double* r, double* coarse) const {
  with_dimension(dim_, [&](auto d) { restrict_of<d>(r, coarse); });
}

void HatGrid::prolong(const double* coarse, double* z) const {
  with_dimension(dim_, [&](auto d) { prolong_of<d>(coarse, z); });
}

#define BS_GRID(d)                                                    \
  template void HatGrid::offsets<d>(PetscInt*) const noexcept;        \
  template void HatGrid::shares<d>(PetscInt, double*) const noexcept; \
  template bool HatGrid::continued_shares<d>(PetscInt, PetscInt, double*) const noexcept;
BS_GRID(1)
BS_GRID(2)
BS_GRID(3)
#undef BS_GRID

}  // namespace bs
