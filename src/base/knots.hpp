// Times at which what is given over time jumps or bends, and which side counts there.
#pragma once
#include <cmath>
#include <cstdint>
#include "base/rounding.hpp"

namespace bs {

/// A time at which a given function of time jumps or bends.
struct Knot {
  double time = INFINITY;  ///< [s]; infinity: there is none
  bool jumps = false;      ///< the function itself, not its slope alone

  bool is(double t) const { return snap(t, time) == time; }
  /// The earlier one of both; of two at one time, but for rounding, one that jumps.
  void take(const Knot& other) {
    if (is(other.time)) jumps = jumps || other.jumps;
    else if (other.time < time) *this = other;
  }
};

/// Whether `knot` is later than t by more than rounding.
inline bool is_after(double t, double knot) { return knot > t && snap(t, knot) != knot; }

/// Which value counts at a knot; `given`: that of the function's definition.
enum class Side : std::uint8_t { given, left, right, mean };

/// The same by time [s].
struct Sides {
  double even_after = INFINITY;  ///< later than this: the mean of both sides
  double left_at = NAN;          ///< a step ends there
  double right_at = NAN;         ///< a step begins there

  Side at(double t) const {
    if (snap(t, left_at) == left_at) return Side::left;
    if (snap(t, right_at) == right_at) return Side::right;
    return snap(t, even_after) > even_after ? Side::mean : Side::given;
  }
};

}  // namespace bs
