#include "systems/particles/free_bodies.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/disjoint_sets.hpp"
#include "base/fault.hpp"
#include "network/ghost_copies.hpp"
#include "systems/particles/particle_model.hpp"
#include "systems/particles/spring_exists.hpp"
#include "systems/particles/supports.hpp"

namespace bs {
namespace {

/// What couples without a spring (angle springs) ties, too, and where there are angle springs one of them may do so across a spring that is none.
bool ties(const Network& net, PetscInt e) { return net.links.spring[e] < 0 || exists(net, e) || !net.interactions.empty(); }

/// Free particles that are tied to each other on this rank.
DisjointSets local_sets(const Network& net) {
  DisjointSets sets(net.n + net.ghosts);
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1] && !net.fixed[i]; ++e)
      if (!net.fixed[net.links.other[e]] && ties(net, e)) sets.join(i, net.links.other[e]);
  return sets;
}

}  // namespace

PetscErrorCode label_bodies(const Network& net, GhostCopies* copies, std::vector<double>* label) {
  DisjointSets sets = local_sets(net);
  const PetscInt count = net.n + net.ghosts;
  std::vector<double> low(static_cast<std::size_t>(count));
  int changed = 1;
  PetscFunctionBegin;
  for (PetscInt i = 0; i < count; ++i) low[i] = static_cast<double>(net.global[i]);
  while (changed) {
    changed = 0;
    for (PetscInt i = 0; i < count; ++i) {
      double& root = low[sets.top(i)];
      root = std::min(root, low[i]);
    }
    for (PetscInt i = 0; i < count; ++i) low[i] = low[sets.top(i)];
    PetscCall(copies->exchange(low, [&](PetscInt ghost, double value) {
      if (value >= low[ghost]) return;
      low[ghost] = value;
      changed = 1;
    }));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, net.comm));
  }
  label->assign(low.begin(), low.begin() + net.n);
  PetscFunctionReturn(0);
}

std::vector<std::uint8_t> held_axes(const Network& net) {
  const std::uint8_t all = static_cast<std::uint8_t>((1 << net.dim) - 1);
  std::vector<std::uint8_t> held(static_cast<std::size_t>(net.n), 0);
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e)
      if (net.fixed[net.links.other[e]] && ties(net, e)) held[i] = all;
  for (const PetscInt i : net.anchors.particle) held[i] = all;
  for (PetscInt i = 0; i < net.n && net.supports; ++i) held[i] |= net.supports->rolling(net.global[i]);
  return held;
}

namespace {

/// Collective. The smallest row in the input among the particles of driven bodies; -1: there are none. `driven`: 1 at the label of each.
PetscErrorCode smallest_row(const Network& net, const std::vector<double>& label, Vec driven, std::int64_t* row) {
  constexpr std::int64_t NONE = std::numeric_limits<std::int64_t>::max();
  const PetscScalar* a = nullptr;
  VecHandle mine;
  ISHandle from;
  ScatterHandle scatter;
  PetscFunctionBegin;
  const std::vector<PetscInt> at(label.begin(), label.end());
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, net.n, mine.out()));
  PetscCall(ISCreateGeneral(net.comm, net.n, at.data(), PETSC_COPY_VALUES, from.out()));
  PetscCall(VecScatterCreate(driven, from, mine, nullptr, scatter.out()));
  PetscCall(VecScatterBegin(scatter, driven, mine, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, driven, mine, INSERT_VALUES, SCATTER_FORWARD));
  *row = NONE;
  PetscCall(VecGetArrayRead(mine, &a));
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i] && a[i] > 0) *row = std::min(*row, net.row[i]);
  PetscCall(VecRestoreArrayRead(mine, &a));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, row, 1, MPI_INT64_T, MPI_MIN, net.comm));
  if (*row == NONE) *row = -1;
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode find_free_bodies(const Network& net, const std::vector<double>& load, FreeBodies* out) {
  GhostCopies copies;
  std::vector<double> label;
  const PetscInt d = net.dim;
  std::vector<VecHandle> sums(static_cast<std::size_t>(d) + 2);  // load, sizes of the loads, and what holds the body
  PetscFunctionBegin;
  PetscCall(copies.create(net));
  PetscCall(label_bodies(net, &copies, &label));
  const std::vector<std::uint8_t> held = held_axes(net);
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const PetscInt c = static_cast<PetscInt>(k);
    PetscCall(VecDuplicate(copies.layout(), sums[k].out()));
    PetscCall(VecZeroEntries(sums[k]));
    for (PetscInt i = 0; i < net.n; ++i) {
      double value = c == d + 1 ? held[i] != 0 : 0;
      for (PetscInt q = 0; q < d && c <= d; ++q)
        if (q == c || c == d) value += c == d ? std::abs(load[i * d + q]) : load[i * d + q];
      if (net.fixed[i] || value == 0) continue;
      PetscCall(VecSetValue(sums[k], static_cast<PetscInt>(label[i]), value, ADD_VALUES));
    }
    PetscCall(VecAssemblyBegin(sums[k]));
    PetscCall(VecAssemblyEnd(sums[k]));
  }
  std::vector<const PetscScalar*> a(sums.size());
  for (std::size_t k = 0; k < sums.size(); ++k) PetscCall(VecGetArrayRead(sums[k], &a[k]));
  VecHandle driven;
  PetscScalar* flag = nullptr;
  PetscInt count = 0;
  PetscCall(VecDuplicate(copies.layout(), driven.out()));
  PetscCall(VecZeroEntries(driven));
  PetscCall(VecGetArray(driven, &flag));
  for (PetscInt i = 0; i < net.n; ++i) {
    if (net.fixed[i] || static_cast<PetscInt>(label[i]) != net.global[i] || a.back()[i] > 0) continue;
    ++count;
    double whole = 0;
    for (PetscInt c = 0; c < d; ++c) whole += std::abs(a[static_cast<std::size_t>(c)][i]);
    if (whole > 1e-12 * a[static_cast<std::size_t>(d)][i]) flag[i] = 1;
  }
  PetscCall(VecRestoreArray(driven, &flag));
  for (std::size_t k = 0; k < sums.size(); ++k) PetscCall(VecRestoreArrayRead(sums[k], &a[k]));
  PetscCallMPI(MPI_Allreduce(&count, &out->count, 1, MPIU_INT, MPI_SUM, net.comm));
  PetscCall(smallest_row(net, label, driven, &out->driven_row));
  PetscFunctionReturn(0);
}

void ParticleModel::set_loads(const Loads& loads) {
  std::get<UniformGravity>(laws_).load = std::get<CentralGravity>(laws_).load = loads.gravity;
  motion_.at_rest = loads.at_rest;
  motion_.at_full_load = loads.anchors_at_full_load;
  supports_.set_static(loads.at_rest, loads.driven_at_full_load);
  cell_.set_static(loads.at_rest, loads.box_at_full_load);
  loads_ = loads.at_rest;
  if (loads.gravity_grows) ledger_.count_loads(laws_);
  interior_.known = false;
  known_ = {};
}

// A law whose force depends on the place (attraction, walls) may hold a body; drag does not.
PetscErrorCode ParticleModel::count_free_bodies(PetscInt* free) {
  const PetscInt d = net_.dim;
  bool may_hold = coupling_.active();
  std::vector<double> load(static_cast<std::size_t>(net_.n * d), 0.0);
  FreeBodies bodies;
  PetscFunctionBegin;
  const auto add = [&](const auto& law, PetscInt i) {
    const double zero[3] = {0, 0, 0};
    const auto at = [&](auto dim) {
      (void)law.template force<decltype(dim)::value>({0, net_.mass[i], net_.columns(i), zero, zero}, load.data() + i * d);
    };
    if (d == 1) at(std::integral_constant<int, 1>{});
    else if (d == 2) at(std::integral_constant<int, 2>{});
    else at(std::integral_constant<int, 3>{});
  };
  for_each_law(laws_, [&](const auto& law) {
    using Law = std::decay_t<decltype(law)>;
    if (!law.active()) return;
    if (Law::potential == Potential::linear)
      for (PetscInt i = 0; i < net_.n; ++i) add(law, i);
    else may_hold = may_hold || Law::potential != Potential::of_velocity;
  });
  PetscCall(find_free_bodies(net_, load, &bodies));
  *free = bodies.count;
  bodies_adrift_ = !may_hold;
  if (bodies.driven_row >= 0 && !may_hold)
    PetscCall(
        tell(net_.comm, Exit::input,
             format("nothing holds particle %lld and what is tied to it against its loads: there is no equilibrium; fix a particle of it, tie it "
                    "to an anchor, or leave the load out",
                    static_cast<long long>(bodies.driven_row))));
  PetscFunctionReturn(0);
}

PetscErrorCode ParticleModel::return_free_bodies(double t_from, Vec from, double t_to, double h, Vec to) {
  const int d = net_.dim;
  double A[9] = {0};
  PetscFunctionBegin;
  if (!bodies_adrift_) PetscFunctionReturn(0);
  if (!bodies_known_) PetscCall(places_.create(net_));
  bodies_known_ = true;
  for (int k = 0; k < d; ++k) A[k * d + k] = 1;
  if (cell_.active()) cell_.carried(t_from, t_to, A);
  PetscCall(places_.pull_back(A, h, from, to));
  PetscFunctionReturn(0);
}

}  // namespace bs
