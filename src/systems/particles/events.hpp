// Log events of the particle loops, as -log_view shows them.
#pragma once
#include <petscsys.h>

namespace bs {

struct ParticleEvents {
  PetscLogEvent force = 0, jacobian = 0, energy = 0, condense = 0, tangent = 0;
};

/// Registered at first use, after PetscInitialize.
const ParticleEvents& particle_events();

}  // namespace bs
