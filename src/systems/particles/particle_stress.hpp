// Stress times volume of single particles and of groups.
#pragma once
#include <petscvec.h>
#include <vector>
#include "base/handle.hpp"
#include "systems/particles/local_state.hpp"
#include "systems/particles/terms.hpp"

namespace bs {

/// Of particle i, tension positive, by the components of stress_components [J]:
///   s_i = 1/2 sum of (T/l) r r over its springs - m c c,   c = v - F' F^-1 x in a periodic box, else v
/// so that the sum over all particles is V sigma of the box. Springs and their dampers alone; fixed particles have no kinetic part.
class ParticleStress {
 public:
  /// Collective. Reads -bs_output_stress and -bs_stress_groups; errors (exit 2): unknown groups.
  PetscErrorCode create(const Network& net);
  bool in_frames() const { return in_frames_; }
  /// Collective. `rows`: (input rows of this rank, d(d+1)/2) in the input's order, borrowed.
  PetscErrorCode field(const Terms& terms, double t, const LocalState& state, PetscInt rows, Vec* out);
  /// Collective. Adds stress_volume/NAME of every group asked for.
  PetscErrorCode observe(const Terms& terms, double t, const LocalState& state, std::vector<Observable>* out);

 private:
  void compute(const Terms& terms, double t, const LocalState& state);

  const Network* net_ = nullptr;
  int count_ = 0;  ///< d(d+1)/2
  bool in_frames_ = false;
  std::vector<std::size_t> groups_;  ///< of the network's
  std::vector<double> values_;       ///< (n, count)
  VecHandle shown_;
};

}  // namespace bs
