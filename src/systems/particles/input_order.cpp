#include "systems/particles/input_order.hpp"
#include <algorithm>
#include <cstring>
#include <utility>
#include "base/collective.hpp"
#include "base/dimension.hpp"
#include "base/vec_array.hpp"
#include "systems/layout.hpp"

namespace bs {
namespace {

/// Calls copy(layout, particle, place in positions and velocities) for every one of `own`, particles of rows [begin, end), that is not -1.
/// Neighbours in the input lie in many places of the state, which are fetched some rows ahead.
template <class Copy>
void for_rows(const std::vector<PetscInt>& own, std::size_t begin, std::size_t end, int dim, const double* state, Copy&& copy) {
  constexpr std::size_t AHEAD = 32;
  with_dimension(dim, [&](auto d) {
    for (std::size_t row = begin; row < end; ++row) {
      constexpr Layout at{decltype(d)::value};
      const double* later = at.of(state, std::max<PetscInt>(own[std::min(row + AHEAD, own.size() - 1)], 0));
      __builtin_prefetch(later);
      __builtin_prefetch(later + at.block() - 1);
      if (own[row] >= 0) copy(at, own[row], row * d);
    }
  });
}

}  // namespace

PetscErrorCode InputOrder::create(const Network& net, PetscInt rows, Vec layout) {
  PetscFunctionBegin;
  net_ = &net;
  own_.assign(static_cast<std::size_t>(rows), -1);
  for (VecHandle* vec : {&position_, &velocity_}) PetscCall(create_vec(net.comm, rows, net.dim, vec->out()));
  PetscCall(create_scatters(layout));
  const PetscMPIInt ranks = size_of(net.comm);
  has_all_ = ranks == 1;
  PetscFunctionReturn(0);
}

/// own_, and scatters of the particles whose rows are another rank's.
PetscErrorCode InputOrder::create_scatters(Vec layout) {
  const PetscInt d = net_->dim;
  PetscInt first = 0;
  std::vector<PetscInt> x_blocks, v_blocks, target;
  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(position_, &first, nullptr));
  first /= d;
  for (PetscInt i = 0; i < net_->n; ++i) {
    const PetscInt row = static_cast<PetscInt>(net_->row[i]), place = row - first;
    if (place >= 0 && place < static_cast<PetscInt>(own_.size())) {
      own_[place] = i;
      continue;
    }
    x_blocks.push_back(2 * net_->global[i]);
    v_blocks.push_back(2 * net_->global[i] + 1);
    target.push_back(row);
  }
  PetscCall(on_some_rank(net_->comm, !target.empty(), &travels_));
  if (!travels_) PetscFunctionReturn(0);
  const PetscInt count = static_cast<PetscInt>(target.size());
  ISHandle x_from, v_from, to;
  PetscCall(ISCreateBlock(net_->comm, d, count, x_blocks.data(), PETSC_COPY_VALUES, x_from.out()));
  PetscCall(ISCreateBlock(net_->comm, d, count, v_blocks.data(), PETSC_COPY_VALUES, v_from.out()));
  PetscCall(ISCreateBlock(net_->comm, d, count, target.data(), PETSC_COPY_VALUES, to.out()));
  PetscCall(VecScatterCreate(layout, x_from, position_, to, to_position_.out()));
  PetscCall(VecScatterCreate(layout, v_from, velocity_, to, to_velocity_.out()));
  PetscFunctionReturn(0);
}

/// Of the particles whose rows are another rank's: from y (forward) or into it.
PetscErrorCode InputOrder::exchange(Vec y, ScatterMode way) {
  PetscFunctionBegin;
  if (!travels_) PetscFunctionReturn(0);
  for (const auto& [scatter, rows] : {std::pair{to_position_.get(), position_.get()}, {to_velocity_.get(), velocity_.get()}}) {
    Vec from = way == SCATTER_FORWARD ? y : rows, to = way == SCATTER_FORWARD ? rows : y;
    PetscCall(scatter_all(scatter, from, to, way));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode InputOrder::from_state(Vec y) {
  PetscFunctionBegin;
  PetscCall(exchange(y, SCATTER_FORWARD));
  const WriteArray ax(position_);
  const WriteArray av(velocity_);
  PetscCall(copy(y, 0, static_cast<PetscInt>(own_.size()), ax, av));
  PetscFunctionReturn(0);
}

/// Rows [first, first + count) that are this rank's own, to x and v.
PetscErrorCode InputOrder::copy(Vec y, PetscInt first, PetscInt count, double* x, double* v) const {
  PetscFunctionBegin;
  const ReadArray ay(y);
  const auto begin = static_cast<std::size_t>(first);
  for_rows(own_, begin, begin + static_cast<std::size_t>(count), net_->dim, ay, [&](auto at, PetscInt from, std::size_t to) {
    const double* state = at.of(ay.data(), from);
    std::memcpy(x + (to - begin * at.dim), state, sizeof(double) * at.dim);
    std::memcpy(v + (to - begin * at.dim), state + at.v(0), sizeof(double) * at.dim);
  });
  PetscFunctionReturn(0);
}

PetscErrorCode InputOrder::make_piece(Vec y, PetscInt first, PetscInt count) {
  PetscFunctionBegin;
  if (piece_ == std::pair{first, count}) PetscFunctionReturn(0);
  const std::size_t numbers = static_cast<std::size_t>(count) * static_cast<std::size_t>(net_->dim);
  x_.resize(std::max(numbers, x_.size()));
  v_.resize(x_.size());
  PetscCall(copy(y, first, count, x_.data(), v_.data()));
  piece_ = {first, count};
  PetscFunctionReturn(0);
}

std::pair<RowSource, RowSource> InputOrder::sources(Vec y) {
  const auto source = [this, y](const std::vector<double>* made) {
    return [this, y, made](PetscInt first, PetscInt count, double* to) {
      PetscFunctionBegin;
      PetscCall(make_piece(y, first, count));
      std::copy_n(made->begin(), static_cast<std::size_t>(count) * static_cast<std::size_t>(net_->dim), to);
      PetscFunctionReturn(0);
    };
  };
  piece_ = {0, 0};  // of another y
  return {source(&x_), source(&v_)};
}

PetscErrorCode InputOrder::to_state(Vec y) {
  PetscFunctionBegin;
  PetscCall(exchange(y, SCATTER_REVERSE));
  const WriteArray ay(y);
  const ReadArray ax(position_);
  const ReadArray av(velocity_);
  for_rows(own_, 0, own_.size(), net_->dim, ay, [&](auto at, PetscInt to, std::size_t from) {
    double* state = at.of(ay.data(), to);
    std::memcpy(state, ax + from, sizeof(double) * at.dim);
    std::memcpy(state + at.v(0), av + from, sizeof(double) * at.dim);
  });
  PetscFunctionReturn(0);
}

}  // namespace bs
