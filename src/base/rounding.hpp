// What rounding leaves of a time that is a sum of steps.
#pragma once
#include <cmath>
#include <limits>

namespace bs {

/// Steps that differ by less than this, relatively, are the same up to rounding.
inline constexpr double SAME_STEP = 1e-9;

/// Steps shorter than this cannot be added to a time t but for a thousandth of their length [s].
inline double time_resolution(double t) { return 1000 * std::numeric_limits<double>::epsilon() * std::abs(t); }

/// By how much a sum of steps may miss a time t; attempts shorter than this do not move it [s].
inline double time_rounding(double t) { return 4 * std::numeric_limits<double>::epsilon() * std::abs(t); }

}  // namespace bs
