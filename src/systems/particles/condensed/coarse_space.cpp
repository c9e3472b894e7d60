#include "systems/particles/condensed/coarse_space.hpp"
#include <cmath>
#include "base/collective.hpp"
#include "base/disjoint_sets.hpp"
#include "base/memory.hpp"
#include "systems/particles/condensed/coarse_energy.hpp"
#include "systems/particles/events.hpp"
#include "systems/particles/supports.hpp"

namespace bs {

namespace {

constexpr double STIFF = 100;     // times the usual spring: a coarse motion must not strain it
constexpr PetscInt CLUSTER = 64;  // particles tied together at most

constexpr double FINE = 60;    // unknowns of S a coarse one stands for
constexpr double MOST = 6000;  // of these at most, over lattices that do not fill their box

/// At most as many where they do: a solve of the coarse grid, which grows as their number to the power 4/3 and is every rank's own, then keeps its
/// share of an iteration, 15 to 20 %. FEW never matter.
double most_in_space(const Network& net) {
  constexpr double FEW = 2200, PARTICLES = 0.3;
  PetscMPIInt ranks = 1;
  MPI_Comm_size(net.comm, &ranks);
  return std::max(FEW, std::pow(PARTICLES * static_cast<double>(net.total) / ranks, 0.75));
}

/// Collective. The geometric mean of the pairs' sizes.
PetscErrorCode usual_size(const SpringMatrix& S, double* usual) {
  double sum[2] = {0, 0};
  PetscFunctionBegin;
  for (std::size_t k = 0; k < S.pattern().pairs(); ++k) {
    const double size = S.pair_size(k);
    if (size > 0) sum[0] += std::log(size), sum[1] += 1;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sum, 2, MPI_DOUBLE, MPI_SUM, S.network().comm));
  *usual = sum[1] > 0 ? std::exp(sum[0] / sum[1]) : 0;
  PetscFunctionReturn(0);
}

/// Where each owned particle counts as being: its start, or the centre of those it is tied to.
std::vector<double> tied_points(const SpringMatrix& S, double usual) {
  const SpringPattern& pattern = S.pattern();
  const Network& net = S.network();
  const int d = net.dim;
  DisjointSets clusters(net.n, CLUSTER);
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k)
      if (S.pair_size(static_cast<std::size_t>(k)) > STIFF * usual) clusters.join(i, pattern.other[k]);
  std::vector<double> centre(static_cast<std::size_t>(net.n * d), 0.0), points(centre.size());
  for (PetscInt i = 0; i < net.n; ++i)
    for (int c = 0; c < d; ++c) centre[clusters.top(i) * d + c] += net.held[i * d + c] / static_cast<double>(clusters.size(i));
  for (PetscInt i = 0; i < net.n; ++i)
    for (int c = 0; c < d; ++c) points[i * d + c] = centre[clusters.top(i) * d + c];
  return points;
}

/// E of one dimension, and the floating-point operations it took.
template <int d>
double sum_energy(const CoarseGrid& grid, const SpringMatrix& S, CoarseBlocks* E, CoarseBlocks* rolling) {
  E->create(grid.nodes(), grid.differences(), CoarseEnergy<d>::WIDTH);
  CoarseEnergy<d> energy(grid, E, rolling);
  energy.sum(S);
  return energy.flops();
}

}  // namespace

PetscErrorCode CoarseSpace::create(SpringMatrix& S, PetscInt unknowns) {
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(particle_events().coarse_set_up, nullptr, nullptr, nullptr, nullptr));
  PetscCall(make(S, unknowns));
  PetscCall(PetscLogEventEnd(particle_events().coarse_set_up, nullptr, nullptr, nullptr, nullptr));
  PetscFunctionReturn(0);
}

/// Collective. E by blocks and as a matrix, on every rank; not asked again while its size stays.
PetscErrorCode CoarseSpace::reserve(double neighbours) const {
  const double blocks = static_cast<double>(grid_.nodes()) * neighbours;
  PetscFunctionBegin;
  PetscCall(reserve_memory(comm_, {"the coarse grid (-condensed_pc_bicc_coarse)", blocks * (8 + 1.5 * dim_ * dim_) * sizeof(double),
                                   "give -condensed_pc_bicc_coarse a smaller number"}));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSpace::make(SpringMatrix& S, PetscInt unknowns) {
  const Network& net = S.network();
  const double all = static_cast<double>(net.total * net.dim);
  bool filled = false;
  double usual = 0;

  PetscFunctionBegin;
  active_ = false;
  if (S.remainder().created()) PetscFunctionReturn(0);  // E would lack what R holds, and the correction be too large
  comm_ = net.comm;
  dim_ = net.dim;
  owned_ = net.n;
  supports_ = net.supports && net.supports->rolls() ? net.supports : nullptr;
  PetscCall(usual_size(S, &usual));
  std::vector<double> points = tied_points(S, usual);
  PetscCall(S.append_ghosts(&points));
  const auto create = [&](double wanted) { return grid_.create(comm_, dim_, net.n, points, net.fixed, static_cast<PetscInt>(wanted / dim_)); };
  const double open = std::min(MOST, all / FINE), solid = std::min(most_in_space(net), all / FINE);
  PetscCall(create(unknowns >= 0 ? std::min<double>(unknowns, all) : open));
  if (unknowns < 0 && solid != open && grid_.nodes() > 0) PetscCall(grid_.fills_space(comm_, &filled));
  if (filled) PetscCall(create(solid));
  if (grid_.nodes() == 0) PetscFunctionReturn(0);
  if (in_.size() != static_cast<std::size_t>(this->unknowns())) PetscCall(reserve(static_cast<double>(grid_.differences().size())));
  PetscCall(factor(S));
  PetscFunctionReturn(0);
}

/// Collective. E, summed over the ranks, and its factors.
PetscErrorCode CoarseSpace::factor(SpringMatrix& S) {
  CoarseBlocks E, rolling;
  int active = 0;
  PetscFunctionBegin;
  rolling.create(grid_.nodes(), supports_ ? grid_.differences() : std::vector<PetscInt>(), static_cast<std::size_t>(dim_ * dim_));
  PetscCall(PetscLogFlops(dim_ == 1   ? sum_energy<1>(grid_, S, &E, &rolling)
                          : dim_ == 2 ? sum_energy<2>(grid_, S, &E, &rolling)
                                      : sum_energy<3>(grid_, S, &E, &rolling)));
  PetscCall(E.sum(comm_));
  if (supports_) PetscCall(rolling.sum(comm_));
  PetscCall(factors_.create(dim_, E, rolling, &active_));
  active = active_;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &active, 1, MPI_INT, MPI_MIN, comm_));  // ranks on unlike processors may round differently
  active_ = active != 0;
  const std::size_t size = static_cast<std::size_t>(unknowns());
  in_.resize(size);
  out_.resize(size);
  PetscFunctionReturn(0);
}

/// Owned rollers' held components of z, kept before and put back after a correction that must leave them alone.
void CoarseSpace::keep_held(double* z, bool restore) {
  std::size_t at = 0;
  if (!restore) kept_.clear();
  for (const Supports::Hold& hold : supports_->holds()) {
    if (hold.particle >= owned_) break;
    for (int c = 0; c < dim_; ++c) {
      if (!(hold.mask >> c & 1)) continue;
      double& value = z[hold.particle * dim_ + c];
      if (restore) value = kept_[at++];
      else kept_.push_back(value);
    }
  }
}

PetscErrorCode CoarseSpace::add(Vec r, Vec z) {
  const std::size_t width = dim_ == 3 ? 4 : static_cast<std::size_t>(dim_), d = static_cast<std::size_t>(dim_);
  const std::size_t nodes = static_cast<std::size_t>(grid_.nodes()), size = nodes * d;
  const PetscScalar* ar = nullptr;
  PetscScalar* az = nullptr;

  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  PetscCall(PetscLogEventBegin(particle_events().coarse, r, z, nullptr, nullptr));
  lanes_.assign(nodes * width, 0.0);
  PetscCall(VecGetArrayRead(r, &ar));
  const double* free = ar;
  if (supports_) {
    free_.assign(ar, ar + static_cast<std::size_t>(owned_) * d);
    supports_->clear(0, owned_, 1, free_.data());
    free = free_.data();
  }
  if (d == 1) grid_.restrict_to<1>(free, lanes_.data());
  else if (d == 2) grid_.restrict_to<2>(free, lanes_.data());
  else grid_.restrict_to<3>(free, lanes_.data());
  PetscCall(VecRestoreArrayRead(r, &ar));
  for (std::size_t k = 0; k < size; ++k) in_[k] = lanes_[k / d * width + k % d];
  PetscCall(sum_over_ranks(comm_, in_.data(), size));
  PetscCall(factors_.solve(in_.data(), out_.data()));
  for (std::size_t k = 0; k < size; ++k) lanes_[k / d * width + k % d] = out_[k];
  PetscCall(VecGetArray(z, &az));
  if (supports_) keep_held(az, false);
  if (d == 1) grid_.prolong<1>(lanes_.data(), az);
  else if (d == 2) grid_.prolong<2>(lanes_.data(), az);
  else grid_.prolong<3>(lanes_.data(), az);
  if (supports_) keep_held(az, true);
  PetscCall(VecRestoreArray(z, &az));
  // of a particle, in each direction: its shares in 2^d corners, and their products with d components, added; the solve has counted its own
  const double corners = static_cast<double>(1 << dim_);
  PetscCall(PetscLogFlops(2 * static_cast<double>(grid_.particles()) * (2 * corners - 3 + 2 * corners * dim_)));
  PetscCall(PetscLogEventEnd(particle_events().coarse, r, z, nullptr, nullptr));
  PetscFunctionReturn(0);
}

}  // namespace bs
