// Whether small systems are solved directly, where the user left the inner solver open.
#pragma once
#include <string>
#include "systems/tangent.hpp"

namespace bs {

struct DirectChoice {
  bool direct = false;
  double flops = -1;  ///< predicted of one Cholesky factorisation of S; negative: too large a system to be counted
  /// The reason in a few words.
  std::string words() const;
};

/// Collective. A sparse direct method for S, or an iterative one: by the predicted work of its factors; the same on any number of ranks.
PetscErrorCode choose_direct(Tangent& tangent, DirectChoice* choice);

}  // namespace bs
