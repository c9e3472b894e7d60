// What rounding leaves of a time that is a sum of steps.
#pragma once
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace bs {

/// Steps that differ by less than this, relatively, are the same up to rounding.
inline constexpr double SAME_STEP = 1e-9;

/// Steps shorter than this cannot be added to a time t but for a thousandth of their length [s].
inline double time_resolution(double t) { return 1000 * std::numeric_limits<double>::epsilon() * std::abs(t); }

/// By how much a sum of steps may miss a time t; attempts shorter than this do not move it [s].
inline double time_rounding(double t) { return 4 * std::numeric_limits<double>::epsilon() * std::abs(t); }

/// `t`, or `knot` if it is that but for the rounding of a sum of steps.
inline double snap(double t, double knot) { return std::isfinite(knot) && std::abs(t - knot) <= 1e-10 * std::abs(knot) ? knot : t; }

/// `t`, or the decimal of up to 14 digits that it is but for its last two bits: 3 steps of 0.1 s end at 0.3 s, not at
/// 0.30000000000000004 s, so that what begins at 0.3 s has begun, and 8 of them not before 0.8 s.
inline double decimal_time(double t) {
  constexpr int DIGITS = 14, EXACT = 22;  // the largest power of ten that is a double
  if (t == 0 || !std::isfinite(t)) return t;
  const int places = DIGITS - 1 - static_cast<int>(std::floor(std::log10(std::abs(t))));
  if (places < 0) return t;
  double decimal;
  if (places <= EXACT) {
    const double scale = std::pow(10.0, places);
    decimal = std::nearbyint(t * scale) / scale;
  } else {
    char text[32];
    std::snprintf(text, sizeof text, "%.*e", DIGITS - 1, t);
    decimal = std::strtod(text, nullptr);
  }
  return std::abs(decimal - t) <= 2 * std::numeric_limits<double>::epsilon() * std::abs(t) ? decimal : t;
}

}  // namespace bs
