#include "systems/particles/local_state.hpp"
#include <algorithm>
#include <cstring>
#include "base/collective.hpp"
#include "base/petsc_versions.hpp"
#include "base/vec_array.hpp"
#include "systems/layout.hpp"
#include "systems/particles/constraints/constraints.hpp"

namespace bs {
namespace {

/// Collective. Whether the velocity of one particle acts on another: dampers along springs, and what else may couple them.
PetscErrorCode velocities_couple(const Network& net, bool* yes) {
  const auto damps = [](double c) { return c != 0; };
  const auto no_spring = [](std::int64_t row) { return row < 0; };
  PetscFunctionBegin;
  const bool couple = std::any_of(net.links.damping.begin(), net.links.damping.end(), damps) ||
                      std::any_of(net.links.spring.begin(), net.links.spring.end(), no_spring) || !net.interactions.empty();
  PetscCall(on_some_rank(net.comm, couple, yes));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode LocalState::create(const Network& net, Vec layout) {
  PetscFunctionBegin;
  net_ = &net;
  width_ = static_cast<std::size_t>(Layout{net.dim}.block());
  values_.assign(static_cast<std::size_t>(net.n + net.ghosts) * width_, 0.0);
  const PetscInt bs = static_cast<PetscInt>(width_);
  // the scatter writes straight behind the owned states
  PetscCall(
      VecCreateSeqWithArray(PETSC_COMM_SELF, bs, net.ghosts * bs, values_.data() + static_cast<std::size_t>(net.n) * width_, ghost_values_.out()));
  PetscCall(velocities_couple(net, &velocities_));
  // positions are every second block of d
  const PetscInt stride = velocities_ ? 1 : 2, block = bs / stride;
  std::vector<PetscInt> there(static_cast<std::size_t>(net.ghosts)), here(there.size());
  for (PetscInt k = 0; k < net.ghosts; ++k) {
    there[k] = stride * net.global[net.n + k];
    here[k] = stride * k;
  }
  ISHandle from, to;
  PetscCall(ISCreateBlock(net.comm, block, net.ghosts, there.data(), PETSC_COPY_VALUES, from.out()));
  PetscCall(ISCreateBlock(PETSC_COMM_SELF, block, net.ghosts, here.data(), PETSC_COPY_VALUES, to.out()));
  PetscCall(VecScatterCreate(layout, from, ghost_values_, to, scatter_.out()));
  PetscFunctionReturn(0);
}

PetscErrorCode LocalState::gather_direction(Vec z) {
  PetscFunctionBegin;
  PetscCall(scatter_begin(z));
  PetscCall(scatter_end(z));
  last_ = {};
  net_->constraints->clear(0, net_->n + net_->ghosts, 2, values_.data());
  PetscFunctionReturn(0);
}

PetscErrorCode LocalState::gather(double t, Vec y) {
  PetscFunctionBegin;
  PetscCall(gather_begin(t, y));
  PetscCall(gather_end(t, y));
  PetscFunctionReturn(0);
}

PetscErrorCode LocalState::gather_begin(double t, Vec y) {
  PetscFunctionBegin;
  PetscCall(scatter_begin(y));
  time_ = t;
  hold(t, 0, net_->n);
  PetscFunctionReturn(0);
}

PetscErrorCode LocalState::gather_end(double t, Vec y) {
  PetscFunctionBegin;
  PetscCall(scatter_end(y));
  hold(t, net_->n, net_->n + net_->ghosts);
  net_->constraints->box().shift_images(t, 1, velocities_, values_.data());
  PetscFunctionReturn(0);
}

PetscErrorCode LocalState::scatter_begin(Vec y) {
  PetscFunctionBegin;
  PetscCall(VecScatterBegin(scatter_, y, ghost_values_, INSERT_VALUES, SCATTER_FORWARD));
  if (!is_last(y)) {
    const ReadArray ay(y);
    copy_owned(ay);
  }
  PetscFunctionReturn(0);
}

/// Whether y, unchanged, is what owned states were taken from last, with nothing driven put in its place since.
bool LocalState::is_last(Vec y) {
  const std::pair<PetscObjectId, PetscObjectState> last = last_;
  (void)PetscObjectGetId(reinterpret_cast<PetscObject>(y), &last_.first);
  (void)PetscObjectStateGet(reinterpret_cast<PetscObject>(y), &last_.second);
  return last == last_;
}

/// Owned states; those that are there already, bit for bit, are not copied: a comparison ends at the first that is not.
void LocalState::copy_owned(const double* states) {
  const std::size_t count = static_cast<std::size_t>(net_->n) * width_;
  if (count == 0 || std::memcmp(states, values_.data(), count * sizeof(double)) == 0) return;
  std::copy_n(states, count, values_.begin());
  ++version_;
}

PetscErrorCode LocalState::scatter_end(Vec y) {
  PetscFunctionBegin;
  PetscCall(VecScatterEnd(scatter_, y, ghost_values_, INSERT_VALUES, SCATTER_FORWARD));
  PetscFunctionReturn(0);
}

void LocalState::drive_to(double t) {
  const Constraints& constraints = *net_->constraints;
  constraints.box().shift_images(time_, -1, false, values_.data());
  constraints.drive(t, 0, net_->n + net_->ghosts, values_.data());
  note_driven();
  constraints.box().shift_images(t, 1, false, values_.data());
  time_ = t;
}

void LocalState::hold(double t, PetscInt first, PetscInt last) {
  net_->constraints->place(t, first, last, values_.data());
  note_driven();
}

/// Owned states may be others than the vector's.
void LocalState::note_driven() {
  if (!net_->constraints->holds_groups()) return;
  last_ = {};
  ++version_;
}

}  // namespace bs
