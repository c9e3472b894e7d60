// The layout of the state y = (x, v) of a second-order system in its vector. Only this header defines it (tests/examples/layers.py looks).
#pragma once
#include <petscvec.h>
#include <cstddef>
#include "base/vec_array.hpp"

namespace bs {

/// Position and velocity of particle i lie side by side: block i of 2d numbers is (x_i, v_i). Vectors over particles alone (a
/// force, a velocity) have blocks of d numbers. Rows of dF/dy are laid out alike: dF/dx_j and dF/dv_j side by side, for column j of a pattern.
struct Layout {
  PetscInt dim = 0;        ///< d
  PetscInt particles = 0;  ///< owned by this rank
  constexpr PetscInt block() const noexcept { return 2 * dim; }
  /// Index of component c of the position (the velocity) of particle i.
  constexpr PetscInt x(PetscInt i, PetscInt c = 0) const noexcept { return i * 2 * dim + c; }
  constexpr PetscInt v(PetscInt i, PetscInt c = 0) const noexcept { return i * 2 * dim + dim + c; }
  /// The block of particle i, its d numbers of the position first.
  template <class T>
  constexpr T* of(T* states, PetscInt i) const noexcept {
    return states + static_cast<std::size_t>(i) * 2 * static_cast<std::size_t>(dim);
  }
  /// Calls f(index of a component of a position, index of that of the velocity) for every component of every owned particle.
  template <class F>
  void for_each(F&& f) const {
    for (PetscInt i = 0; i < particles; ++i)
      for (PetscInt c = 0; c < dim; ++c) f(x(i, c), v(i, c));
  }
};

/// Of a vector that is laid out as a state: its block size is 2d.
inline Layout layout_of(Vec y) {
  PetscInt n = 0, block = 2;
  (void)VecGetLocalSize(y, &n);
  (void)VecGetBlockSize(y, &block);
  return {block / 2, n / block};
}

/// The velocities of a state become 0.
inline PetscErrorCode zero_velocities(Vec y) {
  PetscFunctionBegin;
  const WriteArray a(y);
  layout_of(y).for_each([&](PetscInt, PetscInt v) { a[v] = 0; });
  PetscFunctionReturn(0);
}

}  // namespace bs
