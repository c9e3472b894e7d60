// The strain of every spring, in the input's order: a field of the trajectory.
#pragma once
#include "systems/particles/local_state.hpp"
#include "systems/particles/spring_table.hpp"

namespace bs {

class SpringStrain {
 public:
  /// Collective. `rows`: this rank's springs in the input's order. `net` must outlive the object.
  PetscErrorCode create(const Network& net, const Rows& rows);
  /// Collective. Strains (springs) [1] of the states last gathered; NaN for springs of rest length 0. Borrowed.
  PetscErrorCode compute(const LocalState& state, Vec* strains);
  explicit operator bool() const { return table_.created(); }

 private:
  const Network* net_ = nullptr;
  SpringTable table_;
  VecHandle strains_;
};

}  // namespace bs
