#include "linalg/hat_space.hpp"
#include <cmath>
#include "base/collective.hpp"
#include "base/disjoint_sets.hpp"
#include "base/memory.hpp"
#include "linalg/hat_matrix.hpp"

namespace bs {

namespace {

constexpr double STIFF = 100;     // times the usual pair: a coarse motion must not strain it
constexpr PetscInt CLUSTER = 64;  // points tied together at most

constexpr double FINE = 60, FINE_BENT = 15;  // unknowns of S a coarse one stands for; the same where S has a remainder
constexpr double MOST = 6000;                // of these at most, over systems that do not fill their box

/// At most as many where they do: a solve of the coarse grid, which grows as their number to the power 4/3 and is every rank's own, then keeps its
/// share of an iteration, 15 to 20 %. FEW never matter.
double most_in_space(const Graph& graph) {
  constexpr double FEW = 2200, PARTICLES = 0.3;
  PetscMPIInt ranks = 1;
  MPI_Comm_size(graph.comm, &ranks);
  return std::max(FEW, std::pow(PARTICLES * static_cast<double>(graph.total) / ranks, 0.75));
}

/// Collective. The geometric mean of the pairs' sizes.
PetscErrorCode usual_size(const PairMatrix& S, double* usual) {
  double sum[2] = {0, 0};
  PetscFunctionBegin;
  for (std::size_t k = 0; k < S.pattern().pairs(); ++k) {
    const double size = S.pair_size(k);
    if (size > 0) sum[0] += std::log(size), sum[1] += 1;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sum, 2, MPI_DOUBLE, MPI_SUM, S.graph().comm));
  *usual = sum[1] > 0 ? std::exp(sum[0] / sum[1]) : 0;
  PetscFunctionReturn(0);
}

/// Where each owned point counts as being: its start, or the centre of those it is tied to.
std::vector<double> tied_points(const PairMatrix& S, double usual) {
  const PairPattern& pattern = S.pattern();
  const Graph& graph = S.graph();
  const int d = graph.dim;
  DisjointSets clusters(graph.n, CLUSTER);
  for (PetscInt i = 0; i < graph.n; ++i)
    for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k)
      if (S.pair_size(static_cast<std::size_t>(k)) > STIFF * usual) clusters.join(i, pattern.other[k]);
  std::vector<double> centre(static_cast<std::size_t>(graph.n * d), 0.0), points(centre.size());
  for (PetscInt i = 0; i < graph.n; ++i)
    for (int c = 0; c < d; ++c) centre[clusters.top(i) * d + c] += graph.start[i * d + c] / static_cast<double>(clusters.size(i));
  for (PetscInt i = 0; i < graph.n; ++i)
    for (int c = 0; c < d; ++c) points[i * d + c] = centre[clusters.top(i) * d + c];
  return points;
}

/// E of one dimension, and the floating-point operations it took.
template <int d>
double sum_energy(const HatGrid& grid, const PairMatrix& S, CoarseBlocks* E, CoarseBlocks* full) {
  E->create(grid.nodes(), grid.differences(), HatMatrix<d>::WIDTH);
  HatMatrix<d> energy(grid, E, full);
  energy.sum(S);
  return energy.flops();
}

}  // namespace

PetscErrorCode HatSpace::create(PairMatrix& S, PetscInt unknowns) {
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(linear_events().coarse_set_up, nullptr, nullptr, nullptr, nullptr));
  PetscCall(make(S, unknowns));
  PetscCall(PetscLogEventEnd(linear_events().coarse_set_up, nullptr, nullptr, nullptr, nullptr));
  PetscFunctionReturn(0);
}

/// Collective. E by blocks and as a matrix, on every rank; not asked again while its size stays.
PetscErrorCode HatSpace::reserve(double neighbours) const {
  const double blocks = static_cast<double>(grid_.nodes()) * neighbours;
  PetscFunctionBegin;
  PetscCall(reserve_memory(comm_, {"the coarse grid (-condensed_pc_bicc_coarse)", blocks * (8 + 1.5 * dim_ * dim_) * sizeof(double),
                                   "give -condensed_pc_bicc_coarse a smaller number"}));
  PetscFunctionReturn(0);
}

PetscErrorCode HatSpace::make(PairMatrix& S, PetscInt unknowns) {
  const Graph& graph = S.graph();
  const double all = static_cast<double>(graph.total * graph.dim);
  bool filled = false;
  double usual = 0;

  PetscFunctionBegin;
  active_ = false;
  comm_ = graph.comm;
  dim_ = graph.dim;
  graph_ = &graph;
  PetscCall(usual_size(S, &usual));
  std::vector<double> points = tied_points(S, usual);
  PetscCall(S.append_ghosts(&points));
  const auto create = [&](double wanted) { return grid_.create(comm_, dim_, graph.n, points, graph.fixed, static_cast<PetscInt>(wanted / dim_)); };
  const double fine = S.remainder().created() ? FINE_BENT : FINE;
  const double open = std::min(MOST, all / fine), solid = std::min(most_in_space(graph), all / fine);
  PetscCall(create(unknowns >= 0 ? std::min<double>(unknowns, all) : open));
  if (unknowns < 0 && solid != open && grid_.nodes() > 0) PetscCall(grid_.fills_space(comm_, &filled));
  if (filled) PetscCall(create(solid));
  if (grid_.nodes() == 0) PetscFunctionReturn(0);
  if (in_.size() != static_cast<std::size_t>(this->unknowns())) PetscCall(reserve(static_cast<double>(grid_.differences().size())));
  PetscCall(factor(S));
  PetscFunctionReturn(0);
}

/// Collective. E, summed over the ranks, and its factors.
PetscErrorCode HatSpace::factor(PairMatrix& S) {
  CoarseBlocks E, full;
  const bool some = graph_->holds || S.remainder().created();
  int active = 0;
  PetscFunctionBegin;
  full.create(grid_.nodes(), some ? grid_.differences() : std::vector<PetscInt>(), static_cast<std::size_t>(dim_ * dim_));
  PetscCall(PetscLogFlops(dim_ == 1   ? sum_energy<1>(grid_, S, &E, &full)
                          : dim_ == 2 ? sum_energy<2>(grid_, S, &E, &full)
                                      : sum_energy<3>(grid_, S, &E, &full)));
  PetscCall(E.sum(comm_));
  if (some) PetscCall(full.sum(comm_));
  PetscCall(factors_.create(dim_, E, full, &active_));
  active = active_;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &active, 1, MPI_INT, MPI_MIN, comm_));  // ranks on unlike processors may round differently
  active_ = active != 0;
  const std::size_t size = static_cast<std::size_t>(unknowns());
  in_.resize(size);
  out_.resize(size);
  PetscFunctionReturn(0);
}

PetscErrorCode HatSpace::add(Vec r, Vec z) {
  const std::size_t width = dim_ == 3 ? 4 : static_cast<std::size_t>(dim_), d = static_cast<std::size_t>(dim_);
  const std::size_t nodes = static_cast<std::size_t>(grid_.nodes()), size = nodes * d;
  const PetscScalar* ar = nullptr;
  PetscScalar* az = nullptr;

  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  PetscCall(PetscLogEventBegin(linear_events().coarse, r, z, nullptr, nullptr));
  lanes_.assign(nodes * width, 0.0);
  PetscCall(VecGetArrayRead(r, &ar));
  const double* free = ar;
  if (graph_->holds) {
    free_.assign(ar, ar + static_cast<std::size_t>(graph_->n) * d);
    graph_->clear_held(free_.data());
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
  kept_.clear();
  graph_->for_held([&](std::size_t k) { kept_.push_back(az[k]); });
  if (d == 1) grid_.prolong<1>(lanes_.data(), az);
  else if (d == 2) grid_.prolong<2>(lanes_.data(), az);
  else grid_.prolong<3>(lanes_.data(), az);
  std::size_t at = 0;
  graph_->for_held([&](std::size_t k) { az[k] = kept_[at++]; });
  PetscCall(VecRestoreArray(z, &az));
  // of a point, in each direction: its shares in 2^d corners, and their products with d components, added; the solve has counted its own
  const double corners = static_cast<double>(1 << dim_);
  PetscCall(PetscLogFlops(2 * static_cast<double>(grid_.particles()) * (2 * corners - 3 + 2 * corners * dim_)));
  PetscCall(PetscLogEventEnd(linear_events().coarse, r, z, nullptr, nullptr));
  PetscFunctionReturn(0);
}

}  // namespace bs
