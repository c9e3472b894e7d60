// The number of dimensions as a constant of loops.
#pragma once
#include <cstddef>
#include <type_traits>

namespace bs {

/// f(std::integral_constant<int, d>()) for d = 1, 2 or 3.
template <class F>
decltype(auto) with_dimension(std::ptrdiff_t d, F&& f) {
  if (d == 1) return f(std::integral_constant<int, 1>());
  if (d == 2) return f(std::integral_constant<int, 2>());
  return f(std::integral_constant<int, 3>());
}

}  // namespace bs
