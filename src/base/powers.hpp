// The dimension of a quantity.
#pragma once

namespace bs {

/// Powers of mass, length and time: {0, 1, -1} of a velocity.
struct Powers {
  int mass = 0, length = 0, time = 0;
};

}  // namespace bs
