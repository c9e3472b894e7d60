// A step of time, as forces and what remembers the past see it.
#pragma once
#include <petscsys.h>

namespace bs {

/// A step that is done: it ended at time t after the length h, [s] or of the load factor. `number` counts from 1 on, 0: the start; `attempt`: how
/// many attempts of it were rejected before.
struct Step {
  PetscReal t = 0, h = 0;
  PetscInt number = 0, attempt = 0;
};

}  // namespace bs
