#include "systems/particles/spring_table.hpp"
#include <algorithm>
#include "base/collective.hpp"

namespace bs {

PetscErrorCode SpringTable::create(const Network& net, const Rows& rows) {
  std::vector<PetscInt> target;
  VecHandle like;
  ISHandle to;
  PetscFunctionBegin;
  net_ = &net;
  rows_ = static_cast<PetscInt>(rows.count);
  const std::vector<std::int64_t> row = net.local_rows();
  // A spring is listed at both of its ends. The end with the lower row in the input evaluates it, on any number of ranks; a spring between a particle
  // and its own image is listed twice there, and the first entry evaluates it.
  const auto begin = net.links.spring.begin();
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt k = net.links.start[i]; k < net.links.start[i + 1]; ++k) {
      const std::int64_t other = row[static_cast<std::size_t>(net.links.other[k])];
      if (net.links.spring[k] < 0 || row[static_cast<std::size_t>(i)] > other) continue;
      if (row[static_cast<std::size_t>(i)] == other && std::find(begin + net.links.start[i], begin + k, net.links.spring[k]) != begin + k) continue;
      particle_.push_back(i);
      link_.push_back(k);
      target.push_back(static_cast<PetscInt>(net.links.spring[k]));
    }
  alone_ = size_of(net.comm) == 1;
  if (alone_) target_ = std::move(target);
  if (alone_) PetscFunctionReturn(0);
  const PetscInt count = static_cast<PetscInt>(target.size());
  VecHandle local;
  PetscCall(create_vec(net.comm, count, 1, local.out()));
  PetscCall(create_vec(net.comm, rows_, 1, like.out()));
  PetscCall(ISCreateGeneral(net.comm, count, target.data(), PETSC_COPY_VALUES, to.out()));
  PetscCall(VecScatterCreate(local, nullptr, like, to, scatter_.out()));
  local_.push_back(std::move(local));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringTable::make(std::size_t number, VecHandle* out) {
  PetscFunctionBegin;
  if (!*out) PetscCall(create_vec(net_->comm, rows_, 1, out->out()));
  if (alone_ || number < local_.size()) PetscFunctionReturn(0);
  local_.emplace_back();
  PetscCall(VecDuplicate(local_.front(), local_.back().out()));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringTable::scatter_rows(std::size_t number, Vec out) {
  PetscFunctionBegin;
  if (!alone_) PetscCall(scatter_all(scatter_, local_[number], out));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringTable::fetch_rows(Vec rows) {
  PetscFunctionBegin;
  if (!back_) {
    std::vector<PetscInt> source;
    ISHandle from;
    for (std::size_t e = 0; e < net_->links.spring.size(); ++e)
      if (net_->links.spring[e] >= 0) {
        every_.push_back(static_cast<PetscInt>(e));
        source.push_back(static_cast<PetscInt>(net_->links.spring[e]));
      }
    const PetscInt count = static_cast<PetscInt>(source.size());
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, count, all_.out()));
    PetscCall(ISCreateGeneral(net_->comm, count, source.data(), PETSC_COPY_VALUES, from.out()));
    PetscCall(VecScatterCreate(rows, from, all_, nullptr, back_.out()));
  }
  PetscCall(scatter_all(back_, rows, all_));
  PetscFunctionReturn(0);
}

}  // namespace bs
