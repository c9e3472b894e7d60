// The strain of every spring, in the input's order: a field of the trajectory.
#pragma once
#include "model/particles/local_state.hpp"
#include "system/network.hpp"

namespace bs {

class SpringStrain {
 public:
  /// Collective. `rows`: this rank's springs in the input's order. `net` must outlive the object.
  PetscErrorCode create(const Network& net, const Rows& rows);
  /// Collective. Strains (springs) [1] of the states last gathered; NaN for springs of rest length 0. Borrowed.
  PetscErrorCode compute(const LocalState& state, Vec* strains);
  explicit operator bool() const { return static_cast<bool>(strains_); }

 private:
  const Network* net_ = nullptr;
  std::vector<PetscInt> particle_, link_;  ///< per spring evaluated here: its owned end and its place in net.links
  VecHandle local_, strains_;
  ScatterHandle scatter_;
};

}  // namespace bs
