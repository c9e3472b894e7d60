#include "systems/particles/free_bodies.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/disjoint_sets.hpp"
#include "base/error.hpp"
#include "network/ghost_copies.hpp"
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

PetscErrorCode BodyPlaces::create(const Network& net) {
  GhostCopies copies;
  std::vector<double> label;
  ISHandle from;
  PetscFunctionBegin;
  net_ = &net;
  PetscCall(copies.create(net));
  PetscCall(label_bodies(net, &copies, &label));
  const std::vector<std::uint8_t> held = held_axes(net);
  std::vector<PetscInt> labels;
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i]) labels.push_back(static_cast<PetscInt>(label[static_cast<std::size_t>(i)]));
  std::sort(labels.begin(), labels.end());
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  const PetscInt count = static_cast<PetscInt>(labels.size());
  body_.assign(static_cast<std::size_t>(net.n), -1);
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i])
      body_[static_cast<std::size_t>(i)] = static_cast<PetscInt>(
          std::lower_bound(labels.begin(), labels.end(), static_cast<PetscInt>(label[static_cast<std::size_t>(i)])) - labels.begin());
  PetscCall(VecDuplicate(copies.layout(), whole_.out()));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, count, mine_.out()));
  PetscCall(ISCreateGeneral(net.comm, count, labels.data(), PETSC_COPY_VALUES, from.out()));
  PetscCall(VecScatterCreate(whole_, from, mine_, nullptr, scatter_.out()));
  mass_.assign(labels.size(), 0.0);
  held_.assign(labels.size(), 0);
  for (PetscInt i = 0; i < net.n; ++i)
    if (body_[i] >= 0) mass_[body_[i]] += net.mass[i];
  PetscCall(add_up(&mass_));
  int any = 0;
  for (int c = 0; c < net.dim; ++c) {
    std::vector<double> holds(labels.size(), 0.0);
    for (PetscInt i = 0; i < net.n; ++i)
      if (body_[i] >= 0) holds[body_[i]] += held[i] >> c & 1;
    PetscCall(add_up(&holds));
    for (std::size_t b = 0; b < holds.size(); ++b) {
      if (holds[b] > 0) held_[b] = static_cast<std::uint8_t>(held_[b] | 1 << c);
      else any = 1;
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_LOR, net.comm));
  any_ = any != 0;
  PetscFunctionReturn(0);
}

/// values: of each body of this rank; on return the sums over all ranks that have a part of it, always in the same order.
PetscErrorCode BodyPlaces::add_up(std::vector<double>* values) const {
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(mine_, &a));
  std::copy(values->begin(), values->end(), a);
  PetscCall(VecRestoreArrayWrite(mine_, &a));
  PetscCall(VecZeroEntries(whole_));
  PetscCall(VecScatterBegin(scatter_, mine_, whole_, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(scatter_, mine_, whole_, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterBegin(scatter_, whole_, mine_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter_, whole_, mine_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayWrite(mine_, &a));
  std::copy_n(a, values->size(), values->begin());
  PetscCall(VecRestoreArrayWrite(mine_, &a));
  PetscFunctionReturn(0);
}

// off = sum of m (x_to - A x_from) / sum of m
PetscErrorCode BodyPlaces::pull_back(const double* A, double h, Vec from, Vec to) const {
  const int d = net_->dim;
  const PetscInt n = net_->n;
  const PetscScalar* start = nullptr;
  PetscScalar* end = nullptr;
  PetscFunctionBegin;
  if (!any_) PetscFunctionReturn(0);
  std::vector<std::vector<double>> off(static_cast<std::size_t>(d), std::vector<double>(mass_.size(), 0.0));
  PetscCall(VecGetArrayRead(from, &start));
  PetscCall(VecGetArray(to, &end));
  for (PetscInt i = 0; i < n; ++i)
    for (int r = 0; r < d && body_[i] >= 0; ++r) {
      double carried = 0;
      for (int c = 0; c < d; ++c) carried += A[r * d + c] * start[i * 2 * d + c];
      off[r][body_[i]] += net_->mass[i] * (end[i * 2 * d + r] - carried);
    }
  for (int r = 0; r < d; ++r) {
    PetscCall(add_up(&off[r]));
    for (std::size_t b = 0; b < mass_.size(); ++b) off[r][b] = held_[b] >> r & 1 ? 0 : off[r][b] / mass_[b];
  }
  for (PetscInt i = 0; i < n; ++i)
    for (int r = 0; r < d && body_[i] >= 0; ++r) {
      end[i * 2 * d + r] -= off[r][body_[i]];
      end[i * 2 * d + d + r] -= off[r][body_[i]] / h;
    }
  PetscCall(VecRestoreArray(to, &end));
  PetscCall(VecRestoreArrayRead(from, &start));
  PetscFunctionReturn(0);
}

}  // namespace bs
