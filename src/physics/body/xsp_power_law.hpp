// What the two power laws of .xsp scenes share. Their constants (radius, gap 1) are in the scenes' units:
// pixels and a mass of 1, which stand in place of m and kg.
#pragma once
#include <cmath>
#include "lattice/xsp.hpp"

namespace bs {

/// Integral of s^-p from a to b (a, b > 0): (b^(1-p) - a^(1-p))/(1-p), which is ln(b/a) at p = 1.
inline double power_integral(double a, double b, double p) noexcept {
  const double q = 1 - p, log_ratio = std::log(b / a);
  return std::pow(a, q) * (q == 0 ? log_ratio : std::expm1(q * log_ratio) / q);
}

}  // namespace bs
