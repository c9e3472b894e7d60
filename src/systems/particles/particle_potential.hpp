// The incremental potential of a particle system, along one line of states at a time.
#pragma once
#include "systems/incremental.hpp"
#include "systems/particles/terms.hpp"

namespace bs {

class ParticlePotential final : public Incremental {
 public:
  /// Collective. The arguments must outlive the object; `coupled`: a force acts that couples all particles.
  PetscErrorCode create(const Network& net, const Terms& terms, Vec layout, bool coupled);
  std::string lacks_potential() const override { return lacks_; }
  PetscErrorCode add_kinematic(Vec F, Vec y) override;
  PetscErrorCode follow(Vec y, Vec z) override;
  PetscErrorCode beyond_slope(double t, double sigma, double lambda, PotentialChange* change) override;

 private:
  const Network* net_ = nullptr;
  const Terms* terms_ = nullptr;
  Vec layout_ = nullptr;
  std::string lacks_;
  LocalState state_, line_;  ///< made at first use
};

}  // namespace bs
