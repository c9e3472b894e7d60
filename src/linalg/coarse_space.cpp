#include "linalg/coarse_space.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/dimension.hpp"
#include "base/disjoint_sets.hpp"
#include "base/log_event.hpp"
#include "base/memory.hpp"
#include "base/vec_array.hpp"
#include "linalg/factor_pattern.hpp"
#include "linalg/galerkin.hpp"

namespace bs {

namespace {

constexpr double FINE = 60, FINE_BENT = 12;             // unknowns of S a coarse one stands for; the same where S has a remainder
constexpr double MOST_HATS = 6000, MOST_RIGID = 20000;  // of these at most; hats over systems that do not fill their box
constexpr double REACH = 2;                             // cells over which stiff pairs tie points together
constexpr int BLENDS = 1;                               // steps by which groups are made to overlap: a second one saves few iterations

/// Hats at most where they do: a solve of the coarse grid, which grows as their number to the power 4/3 and is every rank's own, then keeps its
/// share of an iteration, 15 to 20 %. FEW never matter.
double most_in_space(const Graph& graph) {
  constexpr double FEW = 2200, PARTICLES = 0.3;
  return std::max(FEW, std::pow(PARTICLES * static_cast<double>(graph.total) / size_of(graph.comm), 0.75));
}

/// Points that stiff pairs tie to each other, as one set.
DisjointSets stiff_clusters(const PairMatrix& S, double least) {
  const PairPattern& pattern = S.pattern();
  DisjointSets clusters(pattern.n);
  for (PetscInt i = 0; i < pattern.n; ++i)
    for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k)
      if (S.pair_size(static_cast<std::size_t>(k)) > least) clusters.join(i, pattern.other[k]);
  return clusters;
}

/// Where each owned point counts as being for hats: its start or, where `clusters` are small, the centre of its own, so that no hat strains it. A
/// cluster that reaches beyond REACH cells of `grid` is a body that bends and stretches: as one point it would hold the hats of all its
/// cells.
std::vector<double> points_of(DisjointSets& clusters, const Graph& graph, const HatGrid& grid) {
  const std::size_t d = static_cast<std::size_t>(graph.dim), n = static_cast<std::size_t>(graph.n);
  std::vector<double> points(graph.start.begin(), graph.start.begin() + static_cast<std::ptrdiff_t>(n * d)), low(points), high(points);
  std::vector<double> centre(n * d, 0.0);
  std::vector<std::uint8_t> small(n, 1);
  const auto top = [&](std::size_t i) { return static_cast<std::size_t>(clusters.top(static_cast<PetscInt>(i))); };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0, t = top(i); c < d; ++c) {
      const double x = graph.start[i * d + c];
      centre[t * d + c] += x / static_cast<double>(clusters.size(static_cast<PetscInt>(i)));
      low[t * d + c] = std::min(low[t * d + c], x);
      high[t * d + c] = std::max(high[t * d + c], x);
      if (high[t * d + c] - low[t * d + c] > REACH * grid.cell_size(static_cast<int>(c))) small[t] = 0;
    }
  for (std::size_t i = 0; i < n; ++i)
    if (small[top(i)]) std::copy_n(centre.data() + top(i) * d, d, points.data() + i * d);
  return points;
}

/// The floating-point operations it took.
template <int d>
double add_product(const PairMatrix& S, bool rigid, const HatGrid& grid, double least, const RigidMotions& motions, CoarseMatrix* E) {
  if (rigid) return add_galerkin<d>(S, RigidColumns<d>(motions, S.graph()), 0, E);
  return add_galerkin<d>(S, HatColumns<d>(grid, S.graph()), least, E);
}

}  // namespace

PetscErrorCode CoarseSpace::create(PairMatrix& S, bool rigid, PetscInt unknowns) {
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::coarse_set_up);
  rigid_ = rigid;
  graph_ = &S.graph();
  PetscCall(make(S, unknowns));
  PetscFunctionReturn(0);
}

/// Collective.
PetscErrorCode CoarseSpace::make_grid(PairMatrix& S, PetscInt unknowns) {
  const Graph& graph = S.graph();
  const int d = graph.dim;
  const double all = static_cast<double>(graph.total * d), fine = S.remainder().created() ? FINE_BENT : FINE;
  bool filled = false;
  PetscFunctionBegin;
  PetscCall(least_stiff_size(S, &least_));
  std::vector<double> points(graph.start.begin(), graph.start.begin() + graph.n * d);
  PetscCall(S.append_ghosts(&points));
  const auto create = [&](double wanted) { return grid_.create(graph.comm, d, graph.n, points, graph.fixed, static_cast<PetscInt>(wanted / d)); };
  const double open = std::min(MOST_HATS, all / fine), solid = std::min(most_in_space(graph), all / fine);
  PetscCall(create(unknowns >= 0 ? std::min(static_cast<double>(unknowns), all) : open));
  if (unknowns < 0 && solid != open && grid_.nodes() > 0) PetscCall(grid_.fills_space(graph.comm, &filled));
  if (filled) PetscCall(create(solid));
  if (least_ > 0 && grid_.nodes() > 0) {
    DisjointSets clusters = stiff_clusters(S, least_);
    points = points_of(clusters, graph, grid_);
    PetscCall(S.append_ghosts(&points));
    grid_.place(points, graph.fixed);
  }
  shares_ = static_cast<double>(grid_.particles()) * (2.0 * (1 << d) * (1 + d) - 3);
  if (E_.unknowns() != grid_.nodes() * d) {  // not asked again while its size stays
    const double blocks = static_cast<double>(grid_.nodes()) * (std::pow(3, d) + 1) / 2;
    PetscCall(reserve_memory(graph.comm, {"the coarse grid (-condensed_pc_bicc_coarse)", blocks * (8 + 1.5 * d * d) * sizeof(double),
                                          "give -condensed_pc_bicc_coarse a smaller number"}));
  }
  E_.create(grid_.nodes(), d, d == 3 ? 4 : d);
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSpace::make_motions(PairMatrix& S, PetscInt unknowns) {
  const int width = rigid_width(S.dim());
  const PetscInt most = std::max<PetscInt>(1, (unknowns > 0 ? unknowns : static_cast<PetscInt>(MOST_RIGID)) / width);
  const PetscInt fine = static_cast<PetscInt>(S.remainder().created() ? FINE_BENT : FINE);
  const PetscInt size = std::max<PetscInt>(unknowns > 0 ? 1 : fine * width / S.dim(), S.graph().free / most + 1);
  PetscFunctionBegin;
  if (!grouped_) groups_.create(S, size, BLENDS);
  grouped_ = true;
  PetscCall(motions_.create(S, groups_));
  shares_ = 2.0 * width * static_cast<double>(motions_.shares().group.size());
  E_.create(motions_.groups(), width, width);
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSpace::make(PairMatrix& S, PetscInt unknowns) {
  bool definite = false, factored = false;
  PetscFunctionBegin;
  active_ = false;
  if (unknowns == 0 || graph_->free == 0) PetscFunctionReturn(0);
  if (rigid_) PetscCall(make_motions(S, unknowns));
  else PetscCall(make_grid(S, unknowns));
  if (E_.unknowns() == 0) PetscFunctionReturn(0);
  PetscCall(PetscLogFlops(with_dimension(S.dim(), [&](auto d) { return add_product<d>(S, rigid_, grid_, least_, motions_, &E_); })));
  PetscCall(E_.factor(graph_->comm, &definite, &factored));
  active_ = definite || (rigid_ && factored);
  in_.resize(static_cast<std::size_t>(E_.unknowns()));
  out_.resize(in_.size());
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSpace::add(Vec r, Vec z) {
  const PetscScalar* ar = nullptr;
  PetscFunctionBegin;
  if (!active_) PetscFunctionReturn(0);
  const LoggedTime logged(LogEvent::coarse, r);
  PetscCall(VecGetArrayRead(r, &ar));
  const double* free = ar;
  if (graph_->holds) {
    free_.assign(ar, ar + static_cast<std::size_t>(graph_->n * graph_->dim));
    graph_->clear_held(free_.data());
    free = free_.data();
  }
  std::fill(in_.begin(), in_.end(), 0.0);
  if (rigid_) motions_.restrict_to(free, in_.data());
  else grid_.restrict_to(free, in_.data());
  PetscCall(VecRestoreArrayRead(r, &ar));
  PetscCall(sum_over_ranks(graph_->comm, in_.data(), in_.size()));
  PetscCall(E_.solve(in_.data(), out_.data()));
  const WriteArray az(z);
  kept_.clear();
  graph_->for_held([&](std::size_t k) { kept_.push_back(az[k]); });
  if (rigid_) motions_.prolong(out_.data(), az);
  else grid_.prolong(out_.data(), az);
  std::size_t at = 0;
  graph_->for_held([&](std::size_t k) { az[k] = kept_[at++]; });
  PetscCall(PetscLogFlops(2 * shares_));  // the solve has counted its own
  PetscFunctionReturn(0);
}

}  // namespace bs
