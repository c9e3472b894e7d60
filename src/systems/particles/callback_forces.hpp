// Forces that a program on the library computes itself.
#pragma once
#include <string>
#include <vector>
#include "systems/force_callback.hpp"
#include "systems/particles/term.hpp"

namespace bs {

/// Those of the communicator's ForceCallback as a term. The tangent has nothing of them, and they have no potential.
class CallbackForces final : public Term {
 public:
  /// Local. `net` must outlive the object.
  void create(const Network& net);
  bool active() const { return static_cast<bool>(callback_.force); }
  void forces(Part part, double t, const LocalState& state, double* f, Singularity* fault, Energies* sum) const override;
  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const override;
  void supply(double t, const LocalState& state, Supply* sum) const override;
  std::string lacks_potential() const override { return "a force that is computed outside"; }
  void outer_sizes(double t, const LocalState& state, double* size) const override;

 private:
  std::vector<double> evaluate(const std::vector<PetscInt>& which, double t, const LocalState& state) const;
  const Network* net_ = nullptr;
  ForceCallback callback_;
  std::vector<PetscInt> free_[2];  ///< owned particles of either Part that are not fixed, by their rows in the input
};

}  // namespace bs
