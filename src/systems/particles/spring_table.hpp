// Numbers of springs between the network's links and rows in the input's order.
#pragma once
#include <vector>
#include "network/network.hpp"
#include "systems/particles/local_state.hpp"

namespace bs {

class SpringTable {
 public:
  /// Collective. `rows`: this rank's springs in the input's order. `net` must outlive the object.
  PetscErrorCode create(const Network& net, const Rows& rows);
  bool created() const { return net_ != nullptr; }
  /// Collective. `out`, made at first use, receives value(i, e) of every spring: e is its link at owned particle i.
  template <class F>
  PetscErrorCode gather(F&& value, VecHandle* out) {
    PetscScalar* values = nullptr;
    PetscFunctionBegin;
    PetscCall(VecGetArrayWrite(local_, &values));
    for (std::size_t s = 0; s < link_.size(); ++s) values[s] = value(particle_[s], link_[s]);
    PetscCall(VecRestoreArrayWrite(local_, &values));
    PetscCall(scatter_rows(out));
    PetscFunctionReturn(0);
  }
  /// Collective. put(e, value) for every link e of a spring, at both its ends, from `rows` in the input's order.
  template <class F>
  PetscErrorCode spread(Vec rows, F&& put) {
    const PetscScalar* values = nullptr;
    PetscFunctionBegin;
    PetscCall(fetch_rows(rows));
    PetscCall(VecGetArrayRead(all_, &values));
    for (std::size_t k = 0; k < every_.size(); ++k) put(every_[k], values[k]);
    PetscCall(VecRestoreArrayRead(all_, &values));
    PetscFunctionReturn(0);
  }

 private:
  PetscErrorCode scatter_rows(VecHandle* out);
  PetscErrorCode fetch_rows(Vec rows);
  const Network* net_ = nullptr;
  PetscInt rows_ = 0;
  std::vector<PetscInt> particle_, link_;  ///< per spring evaluated here: its owned end and its place in net.links
  std::vector<PetscInt> every_;            ///< links that are springs
  VecHandle local_, all_;
  ScatterHandle scatter_, back_;  ///< the latter made at first use
};

}  // namespace bs
