// How matrices of d x d blocks are kept.
#pragma once

namespace bs {

enum class CondensedStorage {
  springs,  ///< spring by spring, single precision, own kernels
  sbaij,
  baij,
  aij
};

}  // namespace bs
