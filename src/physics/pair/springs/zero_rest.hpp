// Spring without a rest length: linear in the vector between its ends, so regular where they meet.
#pragma once
#include "physics/pair/springs/law.hpp"

namespace bs {

/// Tension T = K l: K [N/m], length l [m]; the rest length is not used.
struct ZeroRestSpring : SpringLawTraits {
  static constexpr const char* title = "zero rest length";
  static constexpr bool regular_at_zero = true;
  static double energy(double l, double K, double) noexcept { return 0.5 * K * l * l; }
  static double tension(double l, double K, double) noexcept { return K * l; }
  static double tension_change(int of, double l, double, double) noexcept { return of == 0 ? l : 0; }
  static double tension_over_length(double, double K, double) noexcept { return K; }
  static double stiffness(double, double K, double) noexcept { return K; }
};

}  // namespace bs
