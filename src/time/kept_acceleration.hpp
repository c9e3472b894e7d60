// The data that the program's own TS types carry from step to step, for checkpoints.
#pragma once
#include <petscts.h>

namespace bs {

/// The data of a TS whose type has Memory::acceleration begins with it.
struct KeptAcceleration {
  Vec kept = nullptr;  ///< (., a_n) at the present state, of the type; a failed step leaves its entries unchanged
  bool known = false;  ///< whether it is: not before the first step
};

/// Of a TS of such a type; borrowed.
PetscErrorCode kept_acceleration(TS ts, KeptAcceleration** out);

}  // namespace bs
