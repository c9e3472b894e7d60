#include "systems/particles/constraints/free_bodies.hpp"
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/disjoint_sets.hpp"
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "network/ghost_copies.hpp"
#include "systems/layout.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {

namespace {

/// Free particles that are tied to each other on this rank.
DisjointSets local_sets(const Network& net) {
  DisjointSets sets(net.n + net.ghosts);
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1] && !net.fixed[i]; ++e)
      if (!net.fixed[net.links.other[e]] && ties(net, e)) sets.join(i, net.links.other[e]);
  return sets;
}

/// Collective. label: (n) the smallest global index in the particle's body, the same on every rank that has a part of it.
PetscErrorCode label_bodies(const Network& net, GhostCopies* copies, std::vector<double>* label) {
  DisjointSets sets = local_sets(net);
  const PetscInt count = net.n + net.ghosts;
  std::vector<double> low(static_cast<std::size_t>(count));
  bool changed = true;
  PetscFunctionBegin;
  for (PetscInt i = 0; i < count; ++i) low[i] = static_cast<double>(net.global[i]);
  while (changed) {
    changed = false;
    for (PetscInt i = 0; i < count; ++i) {
      double& root = low[sets.top(i)];
      root = std::min(root, low[i]);
    }
    for (PetscInt i = 0; i < count; ++i) low[i] = low[sets.top(i)];
    PetscCall(copies->exchange(low, [&](PetscInt ghost, double value) {
      if (value >= low[ghost]) return;
      low[ghost] = value;
      changed = true;
    }));
    PetscCall(on_some_rank(net.comm, changed, &changed));
  }
  label->assign(low.begin(), low.begin() + net.n);
  PetscFunctionReturn(0);
}

/// Bit c of each owned particle: something beyond its body holds it along axis c.
std::vector<std::uint8_t> held_axes(const Network& net) {
  const std::uint8_t all = static_cast<std::uint8_t>((1 << net.dim) - 1);
  std::vector<std::uint8_t> held(static_cast<std::size_t>(net.n), 0);
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1]; ++e)
      if (net.fixed[net.links.other[e]] && ties(net, e)) held[i] = all;
  for (const PetscInt i : net.anchors.particle) held[i] = all;
  for (const PetscInt i : net.constraints->holders()) held[i] |= net.constraints->held(i);
  return held;
}

}  // namespace

PetscErrorCode FreeBodies::find() {
  const Network& net = *net_;
  GhostCopies copies;
  std::vector<double> label;
  ISHandle from;
  PetscFunctionBegin;
  PetscCall(copies.create(net));
  PetscCall(label_bodies(net, &copies, &label));
  label_.clear();
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i]) label_.push_back(static_cast<PetscInt>(label[static_cast<std::size_t>(i)]));
  std::sort(label_.begin(), label_.end());
  label_.erase(std::unique(label_.begin(), label_.end()), label_.end());
  const PetscInt count = static_cast<PetscInt>(label_.size());
  body_.assign(static_cast<std::size_t>(net.n), -1);
  for (PetscInt i = 0; i < net.n; ++i)
    if (!net.fixed[i])
      body_[static_cast<std::size_t>(i)] = static_cast<PetscInt>(
          std::lower_bound(label_.begin(), label_.end(), static_cast<PetscInt>(label[static_cast<std::size_t>(i)])) - label_.begin());
  PetscCall(VecDuplicate(copies.layout(), whole_.out()));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, count, mine_.out()));
  PetscCall(ISCreateGeneral(net.comm, count, label_.data(), PETSC_COPY_VALUES, from.out()));
  PetscCall(VecScatterCreate(whole_, from, mine_, nullptr, scatter_.out()));
  mass_.assign(label_.size(), 0.0);
  for (PetscInt i = 0; i < net.n; ++i)
    if (body_[i] >= 0) mass_[body_[i]] += net.mass[i];
  PetscCall(add_up(&mass_));
  PetscCall(find_held());
  PetscFunctionReturn(0);
}

PetscErrorCode FreeBodies::find_held() {
  const std::vector<std::uint8_t> held = held_axes(*net_);
  bool any = false;
  PetscFunctionBegin;
  held_.assign(label_.size(), 0);
  for (int c = 0; c < net_->dim; ++c) {
    std::vector<double> holds(label_.size(), 0.0);
    for (PetscInt i = 0; i < net_->n; ++i)
      if (body_[i] >= 0) holds[body_[i]] += held[i] >> c & 1;
    PetscCall(add_up(&holds));
    for (std::size_t b = 0; b < holds.size(); ++b) {
      if (holds[b] > 0) held_[b] = static_cast<std::uint8_t>(held_[b] | 1 << c);
      else any = true;
    }
  }
  PetscCall(on_some_rank(net_->comm, any, &any_));
  PetscFunctionReturn(0);
}

PetscErrorCode FreeBodies::count(const Network& net, std::uint64_t springs, const std::vector<double>& load, bool may_hold, PetscInt* free) {
  const PetscInt d = net.dim;
  PetscInt count = 0;
  Error fault;
  PetscFunctionBegin;
  net_ = &net;
  adrift_ = !may_hold;
  PetscCall(find());
  found_ = springs;
  std::vector<double> size(label_.size(), 0.0), whole(label_.size(), 0.0);
  for (PetscInt c = 0; c < d; ++c) {
    std::vector<double> sum(label_.size(), 0.0);
    for (PetscInt i = 0; i < net.n; ++i) {
      if (body_[i] < 0) continue;
      sum[body_[i]] += load[i * d + c];
      size[body_[i]] += std::abs(load[i * d + c]);
    }
    PetscCall(add_up(&sum));
    for (std::size_t b = 0; b < sum.size(); ++b) whole[b] += std::abs(sum[b]);
  }
  PetscCall(add_up(&size));
  for (std::size_t b = 0; b < label_.size(); ++b) count += held_[b] == 0 && label_[b] >= net.first && label_[b] < net.first + net.n;
  PetscCallMPI(MPI_Allreduce(&count, free, 1, MPIU_INT, MPI_SUM, net.comm));
  for (PetscInt i = 0; i < net.n && adrift_; ++i) {
    const PetscInt b = body_[i];
    if (b >= 0 && held_[b] == 0 && whole[b] > 1e-12 * size[b])
      fault.note(net.row[i],
                 format("nothing holds particle %lld and what is tied to it against its loads: there is no equilibrium; fix a particle of "
                        "it, tie it to an anchor, or leave the load out",
                        static_cast<long long>(net.row[i])));
  }
  PetscCall(fail_if_any(net.comm, fault));
  PetscFunctionReturn(0);
}

/// values: of each body of this rank; on return the sums over all ranks that have a part of it, always in the same order.
PetscErrorCode FreeBodies::add_up(std::vector<double>* values) const {
  PetscFunctionBegin;
  std::copy(values->begin(), values->end(), WriteArray(mine_).data());
  PetscCall(VecZeroEntries(whole_));
  PetscCall(scatter_all(scatter_, mine_, whole_, SCATTER_REVERSE, ADD_VALUES));
  PetscCall(scatter_all(scatter_, whole_, mine_));
  std::copy_n(ReadArray(mine_).data(), values->size(), values->begin());
  PetscFunctionReturn(0);
}

// off = sum of m (x_to - A x_from) / sum of m
PetscErrorCode FreeBodies::pull_back(std::uint64_t springs, const double* A, double h, Vec from, Vec to) {
  PetscFunctionBegin;
  if (!adrift_) PetscFunctionReturn(0);
  if (found_ != springs) PetscCall(find());
  found_ = springs;
  if (!any_) PetscFunctionReturn(0);
  const int d = net_->dim;
  const PetscInt n = net_->n;
  const Layout at{d, n};
  std::vector<std::vector<double>> off(static_cast<std::size_t>(d), std::vector<double>(mass_.size(), 0.0));
  const ReadArray start(from);
  const WriteArray end(to);
  for (PetscInt i = 0; i < n; ++i)
    for (int r = 0; r < d && body_[i] >= 0; ++r) {
      double carried = 0;
      for (int c = 0; c < d; ++c) carried += A[r * d + c] * start[at.x(i, c)];
      off[r][body_[i]] += net_->mass[i] * (end[at.x(i, r)] - carried);
    }
  for (int r = 0; r < d; ++r) {
    PetscCall(add_up(&off[r]));
    for (std::size_t b = 0; b < mass_.size(); ++b) off[r][b] = held_[b] >> r & 1 ? 0 : off[r][b] / mass_[b];
  }
  for (PetscInt i = 0; i < n; ++i)
    for (int r = 0; r < d && body_[i] >= 0; ++r) {
      end[at.x(i, r)] -= off[r][body_[i]];
      end[at.v(i, r)] -= off[r][body_[i]] / h;
    }
  PetscFunctionReturn(0);
}

}  // namespace bs
