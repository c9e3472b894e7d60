#include "systems/particles/linearised_forces.hpp"
#include <algorithm>
#include "base/collective.hpp"
#include "base/handle.hpp"
#include "base/log_event.hpp"
#include "base/memory.hpp"
#include "linalg/factor_flops.hpp"
#include "linalg/rigid_modes.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {

PetscErrorCode LinearisedForces::create(const Network& net, const Terms& terms, RowPattern& pattern, Vec layout, bool coupled) {
  PetscFunctionBegin;
  net_ = &net;
  terms_ = &terms;
  pattern_ = &pattern;
  vector_ = layout;
  at_ = {net.dim, net.n};
  coupled_ = coupled;
  const auto some = [](const std::vector<double>& values) { return std::any_of(values.begin(), values.end(), [](double c) { return c != 0; }); };
  PetscCall(on_some_rank(net.comm, some(net.links.damping) || some(net.anchors.damping), &damped_));
  axial_damping_ = damped_ && net.damping_law == DampingLaw::axial;
  PetscCall(state_.create(net, layout));
  PetscFunctionReturn(0);
}

bool LinearisedForces::moves(PetscInt i, PetscInt c) const { return !(net_->constraints->held(i) >> c & 1); }

std::vector<double> LinearisedForces::positions() const {
  std::vector<double> points(static_cast<std::size_t>(net_->n * net_->dim));
  for (PetscInt i = 0; i < net_->n; ++i) std::copy_n(state_.at(i), net_->dim, points.data() + i * net_->dim);
  return points;
}

PetscErrorCode LinearisedForces::linearise(double t, Vec y) {
  PetscFunctionBegin;
  t_ = t;
  linearised_ = true;
  PetscCall(state_.gather(t, y));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearisedForces::change_of_force(Vec z, double* f) {
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::tangent_product, z);
  if (!direction_.created()) PetscCall(direction_.create(*net_, vector_));
  PetscCall(direction_.gather_direction(z));
  for (const Term* term : *terms_) term->multiply_tangent(t_, state_, direction_, f);
  net_->constraints->clear(0, net_->n, 1, f);
  // of a spring at one end: distance and length 3d, rates 10, t dz + w (w.dz) 7d
  PetscCall(PetscLogFlops((10.0 * net_->dim + 10) * static_cast<double>(net_->links.other.size())));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearisedForces::predict_tensions(Vec z, double turn, double* part) {
  PetscFunctionBegin;
  if (!direction_.created()) PetscCall(direction_.create(*net_, vector_));
  PetscCall(direction_.gather_direction(z));
  double most = terms_->pairs().largest_turn(state_, direction_);
  PetscCall(max_over_ranks(net_->comm, &most));
  *part = most > turn ? turn / most : 1;
  next_tensions_.resize(net_->links.other.size());
  terms_->pairs().predict_tensions(state_, direction_, *part, next_tensions_.data());
  tensions_.swap(next_tensions_);
  state_.set_tensions(tensions_.data());
  PetscFunctionReturn(0);
}

double LinearisedForces::damping_rate() const {
  const Links& links = net_->links;
  double most = 0;
  for (PetscInt i = 0; i < net_->n && !links.damping.empty(); ++i) {
    double sum = 0;
    for (PetscInt e = links.start[i]; e < links.start[i + 1]; ++e) sum += links.damping[e];
    most = std::max(most, sum / net_->inertia[i]);
  }
  return most;
}

PetscErrorCode LinearisedForces::damping_force(const double* w, double* f) {
  const PetscInt d = net_->dim;
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  std::fill_n(f, net_->n * d, 0.0);
  if (!damped_ && std::none_of(terms_->begin(), terms_->end(),
                               [](const Term* term) { return term->damps(); })) {  // no spring has a damper: nothing of other particles is needed
    std::vector<double> free;
    if (net_->constraints->rolls()) {
      free.assign(w, w + net_->n * d);
      net_->constraints->clear(0, net_->n, 1, free.data());
      w = free.data();
    }
    terms_->pairs().multiply_law_damping(t_, state_, w, f);
    net_->constraints->clear(0, net_->n, 1, f);
    PetscFunctionReturn(0);
  }
  if (!only_velocity_) PetscCall(VecDuplicate(vector_, only_velocity_.out()));
  PetscCall(VecZeroEntries(only_velocity_));
  PetscCall(VecGetArray(only_velocity_, &a));
  for (PetscInt i = 0; i < net_->n; ++i) std::copy_n(w + i * d, d, a + at_.v(i));
  PetscCall(VecRestoreArray(only_velocity_, &a));
  PetscCall(change_of_force(only_velocity_, f));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearisedForces::create(CondensedStorage storage, Mat* S) {
  PetscFunctionBegin;
  if (storage == CondensedStorage::springs) {
    matrices_.push_back(std::make_unique<PairMatrix>());
    PetscCall(matrices_.back()->create(graph_of(*net_), pairs_of(*net_)));
    matrices_.back()->set_places([this](PetscInt i) { return state_.at(i); });
    PetscCall(matrices_.back()->create_shell(S));
    PetscFunctionReturn(0);
  }
  if (!pattern_->created()) pattern_->create(*net_);
  PetscCall(reserve_memory(net_->comm, {"the condensed matrix of " + net_->source, pattern_->condensed_bytes(net_->dim, storage),
                                        "give -condensed_mat_type springs, which takes less"}));
  PetscCall(pattern_->create_condensed(*net_, storage, S));
  PetscCall(MatSetOption(*S, MAT_SYMMETRIC, PETSC_TRUE));
  if (storage == CondensedStorage::aij) PetscCall(set_rigid_modes(*S));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearisedForces::factor_flops(double* flops) {
  PetscFunctionBegin;
  if (flops_ < 0) PetscCall(predict_factor_flops(net_->comm, net_->dim, net_->row, coupled_ends(*net_), &flops_));
  *flops = flops_;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearisedForces::set_rigid_modes(Mat S) {
  PetscFunctionBegin;
  const Places places = [this](PetscInt i) { return linearised_ ? state_.at(i) : net_->held.data() + i * net_->dim; };
  PetscCall(bs::set_rigid_modes(graph_of(*net_), places, S));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearisedForces::assemble(const Coefficients& abc, bool positive, Mat S) {
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::condense, S);
  if (PairMatrix* springs = PairMatrix::from(S)) {
    springs->set_inertia(abc.mass);
    terms_->condense_springs(t_, state_, abc, positive, springs);
    PetscCall(bs::assemble(S));
  } else {
    RowWriter writer(*net_, *pattern_);
    PetscCall(writer.begin(S));
    PetscCall(terms_->condense_rows(t_, state_, abc, positive, &writer));
    PetscCall(writer.end());
  }
  // of a spring at one end: distance and length 3d, t and w 10 + d; by rows t I + w w^T and its place in two blocks, too
  const double d = net_->dim, blocks = PairMatrix::from(S) ? 0 : 4 * d * d;
  PetscCall(PetscLogFlops((blocks + 4 * d + 10) * static_cast<double>(net_->links.other.size())));
  PetscFunctionReturn(0);
}

Graph graph_of(const Network& net) {
  Graph graph{net.global, net.fixed, net.held, net.inertia};
  graph.comm = net.comm;
  graph.dim = net.dim;
  graph.n = net.n;
  graph.ghosts = net.ghosts;
  graph.total = net.total;
  graph.free = net.total - static_cast<PetscInt>(net.fixed_total);
  graph.interactions = !net.interactions.empty();
  graph.periodic = net.box.active();
  graph.source = net.source;
  for (const double k : net.links.stiffness)
    if (k > 0) {
      graph.softest = graph.stiffest > 0 ? std::min(graph.softest, k) : k;
      graph.stiffest = std::max(graph.stiffest, k);
    }
  if (!net.constraints->rolls()) return graph;
  graph.holds = true;
  for (PetscInt i = 0; i < net.n + net.ghosts; ++i) {
    graph.held.push_back(net.fixed[i] ? std::uint8_t{0} : net.constraints->held(i));
    if (i < net.n && graph.held.back()) graph.holders.push_back(i);
  }
  return graph;
}

PairPattern pairs_of(const Network& net) {
  const Links& links = net.links;
  PairPattern out;
  out.n = net.n;
  out.ghosts = net.ghosts;
  out.start.reserve(static_cast<std::size_t>(net.n) + 1);
  out.start.assign(1, 0);
  out.other.reserve(links.other.size() / 2 + 1);  // each spring between free particles of this rank once
  out.cut_start.assign(1, 0);
  for (PetscInt i = 0; i < net.n; ++i) {
    PetscInt last = -1;  // parallel springs follow each other
    for (PetscInt e = links.start[i]; e < links.start[i + 1] && !net.fixed[i]; ++e) {
      const PetscInt j = net.coupled(i, e);
      if (links.spring[e] < 0 || net.fixed[j] || j < i || j == last || net.own_image(i, links.other[e])) continue;
      if (j < net.n && j != links.other[e]) out.across.push_back(static_cast<PetscInt>(out.other.size()));
      if (j < net.n) out.other.push_back(j);
      else out.ghost.push_back(j - net.n);
      last = j;
    }
    out.start.push_back(static_cast<PetscInt>(out.other.size()));
    if (static_cast<PetscInt>(out.ghost.size()) > out.cut_start.back()) {
      out.cut_row.push_back(i);
      out.cut_start.push_back(static_cast<PetscInt>(out.ghost.size()));
    }
  }
  out.other.shrink_to_fit();
  out.ghost.shrink_to_fit();
  return out;
}

std::vector<PetscInt> coupled_ends(const Network& net) {
  std::vector<PetscInt> ends;
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt e = net.links.start[i]; e < net.links.start[i + 1] && !net.fixed[i]; ++e)
      if (has_block(net, e)) ends.insert(ends.end(), {net.global[i], net.global[net.links.other[e]]});
  return ends;
}

}  // namespace bs
