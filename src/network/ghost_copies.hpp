// A number of every particle, with copies of those of ghosts.
#pragma once
#include <algorithm>
#include <vector>
#include "base/handle.hpp"
#include "base/vec_array.hpp"
#include "network/network.hpp"

namespace bs {

class GhostCopies {
 public:
  /// Collective. `net` must outlive the object.
  PetscErrorCode create(const Network& net) {
    ISHandle from;
    PetscFunctionBegin;
    net_ = &net;
    PetscCall(VecCreateMPI(net.comm, net.n, PETSC_DETERMINE, owned_.out()));
    PetscCall(VecCreateSeq(PETSC_COMM_SELF, net.ghosts, ghosts_.out()));
    PetscCall(ISCreateGeneral(net.comm, net.ghosts, net.global.data() + net.n, PETSC_COPY_VALUES, from.out()));
    PetscCall(VecScatterCreate(owned_, from, ghosts_, nullptr, scatter_.out()));
    PetscFunctionReturn(0);
  }
  /// Collective. values: (n or more), of owned particles; use(ghost, value) is called with local index n and up.
  template <class Value, class Use>
  PetscErrorCode exchange(const std::vector<Value>& values, Use&& use) {
    PetscFunctionBegin;
    std::copy_n(values.begin(), net_->n, WriteArray(owned_).data());
    PetscCall(scatter_all(scatter_, owned_, ghosts_));
    const ReadArray b(ghosts_);
    for (PetscInt g = 0; g < net_->ghosts; ++g) use(net_->n + g, static_cast<Value>(b[g]));
    PetscFunctionReturn(0);
  }
  /// A vector of one number for each particle; borrowed.
  Vec layout() const { return owned_; }

 private:
  const Network* net_ = nullptr;
  VecHandle owned_, ghosts_;
  ScatterHandle scatter_;
};

}  // namespace bs
